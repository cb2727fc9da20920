// Apart from modes.cpp, as either takes the compiler long.
#include <Spectra/SymGEigsShiftSolver.h>

#include <algorithm>
#include <functional>
#include <stdexcept>
#include <string>

#include "modes.hpp"

namespace beam {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// y = A x for Spectra, which wants to set a shift: ours is 0.
struct Operator {
  using Scalar = double;
  Index size;
  std::function<void(const double* x, double* y)> times;

  Index rows() const { return size; }
  Index cols() const { return size; }
  void set_shift(double) {}
  void perform_op(const double* x, double* y) const { times(x, y); }
};

}  // namespace

Eigen::MatrixXd lanczos_modes(const Timoshenko& mesh, Index count) {
  // Rayleigh quotient of the static tip shape: a little above the lowest ω².
  const VectorXd shape = mesh.flexibility_times(mesh.unit_tip_force());
  const double lowest = shape[mesh.tip_index()] / mesh.mass_norm2(shape);

  // ν K⁻¹: the factor ν lifts the eigenvalues ν/ω² to where Spectra's convergence test, which has an absolute part of
  // 4e-11, is relative.
  Operator flexibility{mesh.size(), [&mesh, factor = 1e8 * lowest](const double* x, double* y) {
                         mesh.flexibility_times(x, y);
                         Eigen::Map<VectorXd>(y, mesh.size()) *= factor;
                       }};
  Operator mass{mesh.size(), [&mesh](const double* x, double* y) {
                  std::fill(y, y + mesh.size(), 0.0);
                  mesh.add_mass_times(1.0, x, y);
                }};
  const Index subspace = std::min(mesh.size(), std::max(2 * count, count + 20));
  Spectra::SymGEigsShiftSolver<Operator, Operator, Spectra::GEigsMode::ShiftInvert> solver(flexibility, mass, count,
                                                                                           subspace, 0.0);
  solver.init();  // a fixed pseudo-random start
  const Index converged = solver.compute(Spectra::SortRule::LargestMagn, 300, 1e-12, Spectra::SortRule::SmallestAlge);
  if (converged < count) {
    throw std::runtime_error("beam: only " + std::to_string(converged) + " of " + std::to_string(count) + " modes of " +
                             std::to_string(mesh.elements()) + " elements converged" + remedy);
  }
  return solver.eigenvectors();
}

}  // namespace beam
