#include "generalized_alpha.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "step_cache.hpp"

namespace beam {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// S = mass M + stiffness K of one step size, factorised.
struct StepMatrix {
  double mass = 0.0, stiffness = 0.0;
  BandFactors factors;
};

class GeneralizedAlphaBeam final : public Beam {
 public:
  GeneralizedAlphaBeam(const std::shared_ptr<const Timoshenko>& mesh, const Parameters& p)
      : Beam(mesh, p, p.rho_inf == 1.0 ? 0 : mesh->size() + remembered),
        mesh_(*mesh),
        midpoint_(p.rho_inf == 1.0),
        alpha_m_((2.0 * p.rho_inf - 1.0) / (p.rho_inf + 1.0)),
        alpha_f_(p.rho_inf / (p.rho_inf + 1.0)),
        beta_(0.25 * (1.0 - alpha_m_ + alpha_f_) * (1.0 - alpha_m_ + alpha_f_)),
        gamma_(0.5 - alpha_m_ + alpha_f_),
        rhs_(mesh->size()) {
    const auto most = [](const Eigen::MatrixXd& values) { return values.lpNorm<Eigen::Infinity>(); };
    const double mu = p.density * p.area;
    require_coefficients({most(mesh_.element(1.0, 1.0)), most(mesh_.load(Loads::distributed)), most(struck_), mu,
                          1.0 / mu, alpha_b_, p.area / p.second_moment_of_area});
  }

 private:
  void advance(double h, const Polynomial& c, const Loads& loads) override {
    const StepMatrix& S = cache_.get(h, [this](double size, StepMatrix& matrix) { factorise(size, matrix); });
    Loads::Values seen{};  // by the scheme
    loads.for_each(
        [&](std::size_t i, const Polynomial& f) { seen[i] = midpoint_ ? mean(f, h) : value(f, (1.0 - alpha_f_) * h); });
    if (midpoint_) {
      midpoint_step(S, h, mean(c, h), seen);
    } else {
      alpha_step(S, h, c, loads, seen);
    }
    if (loads.any()) now_.load_work += force(seen).dot(motion_.q - start_.q);
    const double u0 = mesh_.tip(start_.q), u1 = tip_displacement();
    now_.integral = 0.5 * h * (u0 + u1);
    now_.integral_2 = h * h * (2.0 * u0 + u1) / 6.0;
  }

  void midpoint_step(const StepMatrix& S, double h, double tip_force, const Loads::Values& loads) {
    // w without tip force, in which it is linear: a coupling that repeats a step from one state with other forces
    // solves once. What `motion_` still holds is the state that the last step began with.
    if (h != free_size_ || loads != free_loads_ || start_.q != motion_.q || start_.v != motion_.v) {
      rhs_ = 0.5 * h * force(loads);
      mesh_.add_products(1.0, start_.v, -0.5 * h, start_.q, rhs_);
      solve(S, free_);
      free_loads_ = loads;
    }
    if (h != free_size_) {
      rhs_ = 0.5 * h * mesh_.load(Loads::tip);
      solve(S, response_);
      free_size_ = h;
    }
    w_ = free_ + tip_force * response_;
    motion_.q = start_.q + h * w_;
    motion_.v = 2.0 * w_ - start_.v;
    if (alpha_b_ > 0.0) now_.dissipated += h * alpha_b_ * mesh_.stiffness_norm2(w_);
  }

  void alpha_step(const StepMatrix& S, double h, const Polynomial& c, const Loads& loads, const Loads::Values& seen) {
    const VectorXd &q = start_.q, &v = start_.v;
    VectorXd a = start_.memory.head(q.size());
    add_missing(S, c[0], loads.at(0.0), a);
    const double f = 1.0 - alpha_f_;
    rhs_ = force(seen, value(c, f * h));
    w_ = alpha_b_ * (v + (f * (1.0 - gamma_) * h) * a) + q + (f * h) * (v + ((0.5 - beta_) * h) * a);
    mesh_.add_products(-alpha_m_, a, -1.0, w_, rhs_);
    VectorXd next;
    solve(S, next);
    motion_.q = q + h * (v + h * ((0.5 - beta_) * a + beta_ * next));
    motion_.v = v + h * ((1.0 - gamma_) * a + gamma_ * next);
    Loads::Values known = loads.at(h);
    known[Loads::tip] += value(c, h);
    motion_.memory << next, 1.0, Eigen::Map<const VectorXd>(known.data(), Loads::count);
    if (alpha_b_ == 0.0) return;
    w_ = f * motion_.v + alpha_f_ * v;
    now_.dissipated += alpha_b_ * (motion_.q - q).dot(mesh_.stiffness_times(w_));
  }

  /// Makes the acceleration `a` at the step's start know of the forces that it does not know of yet.
  void add_missing(const StepMatrix& S, double tip_force, Loads::Values loads, VectorXd& a) {
    const auto known = start_.memory.tail(remembered);  // whether there was a step, then the loads at its end
    loads[Loads::tip] += tip_force;
    for (std::size_t i = 0; i < loads.size(); ++i) loads[i] -= known[static_cast<Index>(i) + 1];
    rhs_ = force(loads);
    if (known[0] == 0.0) {
      rhs_ -= mesh_.stiffness_times(start_.q + alpha_b_ * start_.v);
    } else if (now_.impulse != 0.0) {
      rhs_ -= alpha_b_ * now_.impulse * mesh_.stiffness_times(struck_);
    }
    if (rhs_.isZero(0.0)) return;
    solve(S, w_);
    a += (1.0 - alpha_m_) * w_;
  }

  /// x = S⁻¹ rhs_ with one step of iterative refinement.
  void solve(const StepMatrix& S, VectorXd& x) {
    x = rhs_;
    S.factors.solve_in_place(x);
    mesh_.add_products(-S.mass, x, -S.stiffness, x, rhs_);
    S.factors.solve_in_place(rhs_);
    x += rhs_;
  }

  void factorise(double h, StepMatrix& S) const {
    const double f = 1.0 - alpha_f_;
    S.mass = midpoint_ ? 1.0 : 1.0 - alpha_m_;
    S.stiffness = midpoint_ ? 0.25 * h * h + 0.5 * alpha_b_ * h : f * (alpha_b_ * gamma_ * h + beta_ * h * h);
    S.factors = mesh_.factors(S.mass, S.stiffness);
  }

  const Timoshenko& mesh_;
  bool midpoint_;
  double alpha_m_, alpha_f_, beta_, gamma_;
  /// For ρ∞ < 1, beside the acceleration.
  static constexpr Index remembered = 1 + Loads::count;

  double free_size_ = 0.0;  // of the step that the next three are of; 0: none
  Loads::Values free_loads_{};
  VectorXd free_, response_;  // w without tip force, and of a unit tip force
  VectorXd rhs_, w_;          // work space
  StepCache<StepMatrix> cache_;
};

}  // namespace

std::unique_ptr<Beam> make_generalized_alpha_beam(const std::shared_ptr<const Timoshenko>& mesh,
                                                  const Parameters& parameters) {
  return std::make_unique<GeneralizedAlphaBeam>(mesh, parameters);
}

}  // namespace beam
