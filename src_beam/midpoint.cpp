#include "midpoint.hpp"

#include <stdexcept>
#include <utility>

#include "step_cache.hpp"

namespace beam {
namespace {

using Eigen::VectorXd;

/// Last correction of the mean velocity, relative to it: what a step leaves of the energy errs by twice as much.
constexpr double solved = 1e-8;
/// Steps of iterative refinement: one up to KAG L²/EI = 1e10 with 1000 elements. Where 20 gain less than 8 digits, the
/// factors are little but rounding.
constexpr int most_refinements = 20;

/// NaN if one value is.
double largest(const VectorXd& x) { return x.cwiseAbs().maxCoeff<Eigen::PropagateNaN>(); }

/// S = M + k K of one step size, factorised.
struct StepMatrix {
  double k = 0.0;
  BandFactors factors;
};

class MidpointBeam final : public Beam {
 public:
  /// `mesh` is that of `owned`.
  MidpointBeam(const Timoshenko& mesh, std::unique_ptr<const Timoshenko> owned, const Parameters& p)
      : Beam(std::move(owned), p), mesh_(mesh), shear_modulus_(p.shear_modulus), rhs_(mesh.size()) {
    const auto most = [](const Eigen::MatrixXd& values) { return values.lpNorm<Eigen::Infinity>(); };
    const double mu = p.density * p.area;
    require_coefficients({most(mesh_.element(1.0, 1.0)), most(mesh_.load(Loads::distributed)), most(struck_), mu,
                          1.0 / mu, alpha_b_, p.area / p.second_moment_of_area});
  }

 private:
  void advance(double h, const Polynomial& c, const Loads& loads) override {
    Loads::Values means{};
    loads.for_each([&](std::size_t i, const Polynomial& f) { means[i] = mean(f, h); });
    w_ = mean_velocity(h, mean(c, h), means);
    now_.q = start_.q + h * w_;
    now_.v = 2.0 * w_ - start_.v;
    if (alpha_b_ > 0.0) now_.scalars.dissipated += h * alpha_b_ * mesh_.stiffness_norm2(w_);
    if (loads.any()) now_.scalars.load_work += force(means).dot(now_.q - start_.q);
    const double u0 = mesh_.tip(start_.q), u1 = tip_displacement();
    now_.scalars.integral = 0.5 * h * (u0 + u1);
    now_.scalars.integral_2 = h * h * (2.0 * u0 + u1) / 6.0;
  }

  VectorXd mean_velocity(double h, double tip_force, const Loads::Values& loads) {
    const StepMatrix& S = cache_.get(h, [this](double size, StepMatrix& matrix) {
      matrix.k = 0.25 * size * size + 0.5 * alpha_b_ * size;
      matrix.factors = mesh_.factors(1.0, matrix.k);
    });
    // w without tip force, in which it is linear: a coupling that repeats a step from one state with other forces
    // solves once.
    if (h != free_size_ || loads != free_loads_ || start_.q != free_start_.q || start_.v != free_start_.v) {
      rhs_ = 0.5 * h * force(loads);
      mesh_.add_products(1.0, start_.v, -0.5 * h, start_.q, rhs_);
      solve(S, free_);
      free_loads_ = loads;
      free_start_ = start_;
    }
    if (h != free_size_) {
      rhs_ = 0.5 * h * mesh_.load(Loads::tip);
      solve(S, response_);
      free_size_ = h;
    }
    return free_ + tip_force * response_;
  }

  /// x = S⁻¹ rhs_ with iterative refinement.
  /// @throws std::domain_error
  void solve(const StepMatrix& S, VectorXd& x) {
    x = rhs_;
    S.factors.solve_in_place(x);
    for (int i = 0; i < most_refinements; ++i) {
      correction_ = rhs_;
      mesh_.add_products(-1.0, x, -S.k, x, correction_);
      S.factors.solve_in_place(correction_);
      x += correction_;
      if (largest(correction_) <= solved * largest(x)) return;
    }
    free_size_ = 0.0;
    throw std::domain_error(
        "beam: rounding leaves no solution of the midpoint rule's equations in a step of this size: "
        "shear_modulus = " +
        number(shear_modulus_) +
        " is too large beside young_modulus; use a "
        "smaller shear_modulus, fewer elements, shorter steps, or the integrator modal");
  }

  const Timoshenko& mesh_;
  double shear_modulus_;    // [Pa]
  double free_size_ = 0.0;  // of the step that the next four are of; 0: none
  Loads::Values free_loads_{};
  State free_start_;
  VectorXd free_, response_;       // w without tip force, and of a unit tip force
  VectorXd rhs_, correction_, w_;  // work space
  StepCache<StepMatrix> cache_;
};

}  // namespace

std::unique_ptr<Beam> make_midpoint_beam(std::unique_ptr<const Timoshenko> mesh, const Parameters& parameters) {
  const Timoshenko& numerics = *mesh;
  return std::make_unique<MidpointBeam>(numerics, std::move(mesh), parameters);
}

}  // namespace beam
