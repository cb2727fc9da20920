#include "modes.hpp"

#include <Eigen/Cholesky>
#include <Eigen/SVD>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "text.hpp"

namespace beam {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Residual up to which a mode counts as found. The solvers leave 1e-15 … 1e-9, the most for slender beams.
constexpr double residual_tolerance = 1e-6;

/// A static shape whose part outside the basis is smaller than this (in the M-norm, relative) is already in it.
/// The compliance missed by dropping it is of the same relative size, since the residual of K⁻¹e consists of modes
/// that enter it with φ(L)/ω².
constexpr double rank_tolerance = 1e-12;

/// Singular values and right vectors. @throws std::runtime_error where Eigen would leave them uninitialised
Eigen::BDCSVD<MatrixXd> singular_values(const MatrixXd& X) {
  if (!X.allFinite()) throw std::runtime_error("beam: the parameters leave the range of floating-point numbers");
  const Eigen::BDCSVD<MatrixXd> svd(X, Eigen::ComputeThinV);
  if (svd.info() != Eigen::Success) throw std::runtime_error("beam: the modes cannot be computed");
  return svd;
}

/// Lowest modes from the singular values of G C⁻¹, where K = GᵀG and M = CᵀC: a dense decomposition, but its error
/// relative to ω₁ is ε ω_max/ω₁, where that of the eigenproblem of K would be the square of the ratio.
MatrixXd dense_modes(const Timoshenko& mesh, Index count) {
  const Index size = mesh.size();
  const Timoshenko::MassFactor M(mesh.mass());
  require_factor(M);
  MatrixXd X = M.matrixU().solve(MatrixXd::Identity(size, size));
  VectorXd strains(size);
  for (Index j = 0; j < size; ++j) {
    mesh.weighted_strains(X.col(j).data(), strains.data());
    X.col(j) = strains;
  }
  const Eigen::BDCSVD<MatrixXd> svd = singular_values(X);
  MatrixXd modes = svd.matrixV().rightCols(count).rowwise().reverse();
  return M.matrixU().solve(modes);
}

/// Appends what `shape` has outside the M-orthonormal columns of `basis`, normalised; nothing if that is nothing.
void augment(const Timoshenko& mesh, VectorXd shape, MatrixXd& basis, Index& columns) {
  const double whole = std::sqrt(mesh.mass_norm2(shape));
  for (int pass = 0; pass < 3; ++pass) {
    const VectorXd Mx = mesh.mass_times(shape);
    shape.noalias() -= basis.leftCols(columns) * (basis.leftCols(columns).transpose() * Mx);
    const double rest = std::sqrt(mesh.mass_norm2(shape));
    if (!(rest > (pass == 0 ? rank_tolerance * whole : 0.5))) return;
    shape /= rest;
  }
  basis.col(columns++) = shape;
}

/// Z becomes the transformation W for which Z W diagonalises both forms in span Z; returns ω.
/// The stiffness Gram matrix is formed of strains scaled to unit length, of which only well-conditioned matrices
/// remain: frequencies that differ by orders of magnitude keep their digits.
VectorXd rayleigh_ritz(const Timoshenko& mesh, const MatrixXd& Z, MatrixXd& W) {
  const Index m = Z.cols();
  MatrixXd work = MatrixXd::Zero(mesh.size(), m);
  for (Index k = 0; k < m; ++k) mesh.add_mass_times(1.0, Z.col(k).data(), work.col(k).data());
  const MatrixXd mass = Z.transpose() * work;
  VectorXd scale(m);
  for (Index k = 0; k < m; ++k) {
    mesh.weighted_strains(Z.col(k).data(), work.col(k).data());
    scale[k] = work.col(k).norm();
    work.col(k) /= scale[k];
  }
  const MatrixXd stiffness = work.transpose() * work;
  const Eigen::LLT<MatrixXd> mass_factor(mass), stiffness_factor(stiffness);
  if (mass_factor.info() != Eigen::Success || stiffness_factor.info() != Eigen::Success) {
    throw std::runtime_error("beam: the modes found are not independent; keep fewer n_modes");
  }
  // X = R_K S R_M⁻¹ with XᵀX similar to the pencil: its singular values are ω.
  MatrixXd X = stiffness_factor.matrixU();
  X *= scale.asDiagonal();
  mass_factor.matrixU().solveInPlace<Eigen::OnTheRight>(X);
  const Eigen::BDCSVD<MatrixXd> svd = singular_values(X);
  W = svd.matrixV().rowwise().reverse();
  mass_factor.matrixU().solveInPlace(W);
  return svd.singularValues().reverse();
}

}  // namespace

Modes compute_modes(const Timoshenko& mesh, const Parameters& p) {
  const Index size = mesh.size();
  const Index count = p.n_modes == 0 ? size : p.n_modes;
  const bool dense = size <= 40 || (size <= max_dense_unknowns && count > size / 4);

  Index columns = count;
  MatrixXd basis(size, std::min(size, count + 3));
  basis.leftCols(count) = dense ? dense_modes(mesh, count) : lanczos_modes(mesh, count);

  Modes modes;
  VectorXd y(size);
  for (Index k = 0; k < count; ++k) {
    const double omega2 = mesh.stiffness_norm2(basis.col(k)) / mesh.mass_norm2(basis.col(k));
    y = mesh.flexibility_times(mesh.mass_times(basis.col(k)));
    const double residual = std::sqrt(mesh.stiffness_norm2(basis.col(k) - omega2 * y) / omega2);
    if (!(residual <= residual_tolerance)) {
      throw std::runtime_error("beam: mode " + std::to_string(k + 1) + " of " + std::to_string(count) + " (" +
                               number(std::sqrt(omega2)) + " rad/s) did not converge: its residual is " +
                               number(residual) + ", allowed is " + number(residual_tolerance) + remedy);
    }
    modes.residual = std::max(modes.residual, residual);
  }

  if (count < size) {
    for (const VectorXd& shape : {mesh.flexibility_times(mesh.unit_tip_force()),
                                  mesh.flexibility_times(mesh.load(Loads::distributed)), mesh.linear_shape()}) {
      if (columns < basis.cols()) augment(mesh, shape, basis, columns);
    }
    basis.conservativeResize(Eigen::NoChange, columns);
  }

  MatrixXd W;
  if (count < size) {
    modes.omega = rayleigh_ritz(mesh, basis, W);
  } else {
    // Nothing was added. The Rayleigh quotient is a quotient of sums of squares and errs by the square of the mode's
    // error only, the singular value by ε ω_max.
    W = MatrixXd::Identity(size, size);
    modes.omega.resize(size);
    for (Index k = 0; k < size; ++k) {
      modes.omega[k] = std::sqrt(mesh.stiffness_norm2(basis.col(k)) / mesh.mass_norm2(basis.col(k)));
    }
  }

  // Only rows of Φ = Z W that are ever asked for are formed; from θ̃ to θ, and from M = ∫ to ρA ∫.
  const double norm = 1.0 / std::sqrt(mesh.mass_per_length());
  W *= norm;
  for (Index k = 0; k < columns; ++k) {
    if (basis.row(mesh.tip_index()).dot(W.col(k)) < 0.0) W.col(k) = -W.col(k);
  }
  const double rotation_norm = 1.0 / mesh.radius_of_gyration();
  MatrixXd u(shape_points, columns), theta(shape_points, columns);
  for (Index k = 0; k < columns; ++k) {
    mesh.sample_deflection(basis.col(k).data(), u.col(k).data());
    mesh.sample_scaled_rotation(basis.col(k).data(), theta.col(k).data());
  }
  modes.deflection = u * W;
  MatrixXd shear(shape_points, columns), moment(shape_points, columns);
  for (Index k = 0; k < columns; ++k) {
    const InternalForces forces = mesh.inertia(basis.col(k).data());
    shear.col(k) = Eigen::Map<const VectorXd>(forces.shear.data(), shape_points);
    moment.col(k) = Eigen::Map<const VectorXd>(forces.moment.data(), shape_points);
  }
  modes.shear = shear * W;
  modes.moment = moment * W;
  modes.resultants = LoadResultants(mesh);
  modes.rotation = rotation_norm * (theta * W);
  modes.tip = (basis.row(mesh.tip_index()) * W).transpose();
  modes.tip_rotation = rotation_norm * (basis.row(mesh.tip_rotation_index()) * W).transpose();
  for (std::size_t i = 0; i < Loads::count; ++i) modes.loads[i] = W.transpose() * (basis.transpose() * mesh.load(i));
  modes.linear_shape =
      mesh.mass_per_length() * (W.transpose() * (basis.transpose() * mesh.mass_times(mesh.linear_shape())));
  return modes;
}

}  // namespace beam
