#include "modes.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

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

/// The modes in the span of the M-orthonormal columns of Z, ω ascending: the right singular vectors of the weighted
/// strains of Z. Their error is relative to ω₁ by ε ω_max/ω₁, where that of the eigenproblem of K would be by the
/// square of the ratio.
MatrixXd modes_among(const Timoshenko& mesh, const MatrixXd& Z) {
  MatrixXd X(Z.rows(), Z.cols());
  for (Index k = 0; k < Z.cols(); ++k) X.col(k) = mesh.weighted_strains(Z.col(k));
  // Eigen leaves singular values of what is not finite uninitialised.
  if (!X.allFinite()) throw std::runtime_error("beam: the parameters leave the range of floating-point numbers");
  X /= X.cwiseAbs().maxCoeff();
  // The squares give all but the lowest, in little time; rotations by Jacobi then find these to ε of the highest.
  const Eigen::SelfAdjointEigenSolver<MatrixXd> squares(X.transpose() * X);
  if (squares.info() != Eigen::Success) throw std::runtime_error("beam: the modes cannot be computed");
  const MatrixXd V = squares.eigenvectors().rowwise().reverse();
  X *= V;
  const Eigen::HouseholderQR<MatrixXd> qr(X);
  const MatrixXd R = qr.matrixQR().topRows(Z.cols()).triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<MatrixXd, Eigen::NoQRPreconditioner> svd(R, Eigen::ComputeThinV);
  return Z * (V * svd.matrixV()).rowwise().reverse();
}

/// All modes of the mesh.
MatrixXd dense_modes(const Timoshenko& mesh) {
  MatrixXd M = MatrixXd::Identity(mesh.size(), mesh.size());
  for (Index k = 0; k < M.cols(); ++k) M.col(k) = mesh.mass_times(M.col(k));
  return modes_among(mesh, M.llt().matrixU().solve(MatrixXd::Identity(mesh.size(), mesh.size())));
}

/// Appends what `shape` has outside the M-orthonormal columns of `basis`, normalised; nothing if that is nothing.
void augment(const Timoshenko& mesh, VectorXd shape, MatrixXd& basis, Index& columns) {
  const double whole = std::sqrt(mesh.mass_norm2(shape));
  for (int pass = 0; pass < 3; ++pass) {
    const VectorXd Mx = mesh.mass_times(shape);
    shape.noalias() -= basis.leftCols(columns) * (basis.leftCols(columns).transpose() * Mx);
    const double outside = std::sqrt(mesh.mass_norm2(shape));
    if (!(outside > (pass == 0 ? rank_tolerance * whole : 0.5))) return;
    shape /= outside;
  }
  basis.col(columns++) = shape;
}

}  // namespace

Modes compute_modes(const Timoshenko& mesh, Index n_modes) {
  const Index size = mesh.size();
  const Index count = n_modes == 0 ? size : n_modes;
  const bool dense = size <= 40 || (size <= max_dense_unknowns && count > size / 4);

  Index columns = count;
  MatrixXd basis(size, std::min(size, count + 3));
  basis.leftCols(count) = dense ? dense_modes(mesh).leftCols(count) : lanczos_modes(mesh, count);

  Modes modes;
  for (Index k = 0; k < count; ++k) {
    const double omega2 = mesh.stiffness_norm2(basis.col(k)) / mesh.mass_norm2(basis.col(k));
    const VectorXd y = mesh.flexibility_times(mesh.mass_times(basis.col(k)));
    const double residual = std::sqrt(mesh.stiffness_norm2(basis.col(k) - omega2 * y) / omega2);
    if (!(residual <= residual_tolerance)) {
      throw std::runtime_error("beam: mode " + std::to_string(k + 1) + " of " + std::to_string(count) + " (" +
                               number(std::sqrt(omega2)) + " rad/s) did not converge: its residual is " +
                               number(residual) + ", allowed is " + number(residual_tolerance) + remedy);
    }
    modes.residual = std::max(modes.residual, residual);
  }

  if (count < size) {
    for (const VectorXd& shape : {mesh.flexibility_times(mesh.load(Loads::tip)),
                                  mesh.flexibility_times(mesh.load(Loads::distributed)), mesh.linear_shape()}) {
      if (columns < basis.cols()) augment(mesh, shape, basis, columns);
    }
    basis = modes_among(mesh, basis.leftCols(columns));
  }

  modes.omega.resize(columns);
  modes.tip_rotations.resize(columns);
  for (MatrixXd* rows : {&modes.deflections, &modes.rotations, &modes.shears, &modes.moments})
    rows->resize(shape_points, columns);
  for (Index k = 0; k < columns; ++k) {
    auto mode = basis.col(k);
    if (mesh.tip(mode) < 0.0) mode = -mode;
    // A quotient of sums of squares, which errs by the square of the mode's error only.
    modes.omega[k] = std::sqrt(mesh.stiffness_norm2(mode) / mesh.mass_norm2(mode));
    modes.tip_rotations[k] = mesh.tip_rotation(mode);
    modes.deflections.col(k) = mesh.deflection(mode);
    modes.rotations.col(k) = mesh.rotation(mode);
    const InternalForces forces = mesh.inertia(mode);
    modes.shears.col(k) = forces.shear;
    modes.moments.col(k) = forces.moment;
  }
  for (std::size_t i = 0; i < Loads::count; ++i) modes.loads[i] = basis.transpose() * mesh.load(i);
  modes.start = basis.transpose() * mesh.mass_times(mesh.linear_shape());
  return modes;
}

}  // namespace beam
