// Apart from modes.cpp, as either takes the compiler long.
#include "eigen.hpp"

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
  const VectorXd shape = mesh.flexibility_times(mesh.load(Loads::tip));
  const double lowest = mesh.tip(shape) / mesh.mass_norm2(shape);

  // ν K⁻¹: the factor ν lifts the eigenvalues ν/ω² to where Spectra's convergence test, which has an absolute part of
  // 4e-11, is relative.
  using Map = Eigen::Map<VectorXd>;
  using Given = Eigen::Map<const VectorXd>;
  const Index size = mesh.size();
  Operator flexibility{size, [&mesh, size, factor = 1e8 * lowest](const double* x, double* y) {
                         Map(y, size) = factor * mesh.flexibility_times(Given(x, size));
                       }};
  Operator mass{size, [&mesh, size](const double* x, double* y) { Map(y, size) = mesh.mass_times(Given(x, size)); }};
  const Index subspace = std::min(size, std::max(2 * count, count + 20));
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
