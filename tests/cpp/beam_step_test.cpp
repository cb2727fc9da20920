// Time stepping: exactness of the modal step, the paper's (62), order of the midpoint rule, the energy identity.

#include <gtest/gtest.h>

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "beam.hpp"
#include "beam_testing.hpp"

namespace beam {
namespace {

using testing::changed;
using testing::every_load;
using testing::general_beam;
using testing::mechanical_energy;
using testing::Noise;
using testing::outputs;
using testing::shifted;
using testing::unit_beam;
using testing::with_integrator;

TEST(BeamStep, OneModalStepEqualsTenShorterOnes) {
  enum class Bent { both, force, loads };
  for (const Parameters& mesh : {general_beam(15), general_beam(2, 5)}) {
    for (const double alpha_b : {0.0, 1e-4, 0.02, 10.0}) {
      for (const auto& [H, bent] :
           {std::pair(1e-5, Bent::both), std::pair(1e-2, Bent::both), std::pair(0.7, Bent::both),
            std::pair(30.0, Bent::both), std::pair(0.7, Bent::force), std::pair(0.7, Bent::loads)}) {
        Parameters p = mesh;
        p.alpha_b = alpha_b;
        p.initial_deflection_slope = 0.03;
        p.initial_velocity_slope = 0.5;
        p.point_force_position = {0.0, 0.37, 0.5, 1.0};
        Noise noise;
        Polynomial c = {0.3, -2.0 / H, 5.0 / (H * H)};
        Loads loads = every_load(H, noise);
        if (bent != Bent::both) {  // a second derivative without a first one, and nothing else that varies
          const bool force = bent == Bent::force;
          c = {c[0], 0.0, force ? c[2] : 0.0};
          loads = changed(loads, [force](const Polynomial& f) { return Polynomial{f[0], 0.0, force ? 0.0 : f[2]}; });
        }
        const auto once = make_beam(p), often = make_beam(p);
        once->step(H, c, loads);
        double integral = 0.0, integral_2 = 0.0;
        for (int i = 0; i < 10; ++i) {
          const auto later = [t = i * H / 10](const Polynomial& f) { return shifted(f, t); };
          often->step(H / 10, later(c), changed(loads, later));
          integral += often->tip_displacement_integral();
          integral_2 += often->tip_displacement_integral_2() + (9 - i) * H / 10 * often->tip_displacement_integral();
        }
        // Rounding of H/10 turns into a phase ε ωH: at most 2e-16·ω_max H, ω_max = 164 rad/s on both
        // meshes.
        const double tolerance = 1e-13 * std::max(1.0, 164.0 * H / 100.0);
        EXPECT_NEAR(once->tip_displacement(), often->tip_displacement(), tolerance) << alpha_b << " " << H;
        EXPECT_NEAR(once->tip_velocity(), often->tip_velocity(), 100.0 * tolerance) << alpha_b << " " << H;
        EXPECT_NEAR(once->tip_displacement_integral(), integral, tolerance * H) << alpha_b << " " << H;
        EXPECT_NEAR(once->tip_displacement_integral_2(), integral_2, tolerance * H * H) << alpha_b << " " << H;
        EXPECT_NEAR(once->strain_energy(), often->strain_energy(), 100.0 * tolerance) << alpha_b << " " << H;
        EXPECT_NEAR(once->dissipated_energy(), often->dissipated_energy(), 10.0 * tolerance) << alpha_b << " " << H;
        EXPECT_NEAR(once->load_work(), often->load_work(), 10.0 * tolerance) << alpha_b << " " << H;
      }
    }
  }
}

TEST(BeamStep, IntegralsAreThoseOfTheDisplacement) {
  // Against Simpson's rule over 2000 exact short steps of 1e-4: error (ω_max 1e-4)⁴/180·amplitude ~ 1e-8 of 2e-3.
  Parameters p = general_beam(15);
  p.alpha_b = 1e-3;
  p.initial_velocity_slope = 0.5;
  const Polynomial c = {0.3, -2.0, 30.0};
  const double H = 0.2;
  const auto once = make_beam(p), often = make_beam(p);
  once->step(H, c, 0.6);
  constexpr int n = 2000;
  double integral = often->tip_displacement(), weighted = H * often->tip_displacement();
  for (int i = 1; i <= n; ++i) {
    often->step(H / n, shifted(c, (i - 1) * H / n), 0.6);
    const double weight = i == n ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
    integral += weight * often->tip_displacement();
    weighted += weight * (H - H * i / n) * often->tip_displacement();  // ∫∫u = ∫(H − τ)u dτ
  }
  EXPECT_NEAR(once->tip_displacement_integral(), integral * H / n / 3.0, 1e-10);
  EXPECT_NEAR(once->tip_displacement_integral_2(), weighted * H / n / 3.0, 1e-11);
}

// The paper's (59) and (62) with its own block ordering, for EI = KAG = ρA = ρI = L = 1. λ_nc(Ψ − u)₊^p is the contact
// force there, at both ends of the step; constant here. f_b = 1 − 6ψ_n, all of it as a vector of coefficients.
TEST(BeamStep, MidpointRuleIsThePapersEquation62) {
  for (const auto& [n, alpha_b] :
       {std::pair(1, 0.03), std::pair(2, 0.0), std::pair(11, 0.03), std::pair(12, 0.0), std::pair(12, 0.03)}) {
    const double hx = 1.0 / n;
    for (const double ht : {1e-3, 0.1, 3.0}) {
      Eigen::MatrixXd M = Eigen::MatrixXd::Zero(n, n), K = M, S = M;
      for (int i = 0; i < n; ++i) {
        const bool last = i == n - 1;
        M(i, i) = (last ? 2.0 : 4.0) * hx / 6.0;
        K(i, i) = (last ? 1.0 : 2.0) / hx;
        S(i, i) = last ? 0.5 : 0.0;  // ∫ψ_i ψ_i'
        if (!last) {
          M(i, i + 1) = M(i + 1, i) = hx / 6.0;
          K(i, i + 1) = K(i + 1, i) = -1.0 / hx;
          S(i, i + 1) = 0.5;
          S(i + 1, i) = -0.5;
        }
      }
      const double plus = ht * ht + 2.0 * alpha_b * ht, minus = 2.0 * alpha_b * ht - ht * ht;
      Eigen::MatrixXd A(2 * n, 2 * n), B(2 * n, 2 * n);
      A << (4.0 + plus) * M + plus * K, -plus * S, -plus * S.transpose(), 4.0 * M + plus * K;
      B << (4.0 + minus) * M + minus * K, -minus * S, -minus * S.transpose(), 4.0 * M + minus * K;
      Eigen::VectorXd f_b = Eigen::VectorXd::Zero(n);
      f_b[n - 1] = -6.0;

      Parameters p = with_integrator(unit_beam(n), Integrator::midpoint);
      p.alpha_b = alpha_b;
      p.initial_deflection_slope = 0.1;
      p.initial_velocity_slope = -1.0;
      Loads hat;
      hat.set(Loads::hat, {-6.0, 0.0, 0.0});
      const auto b = make_beam(p);

      Eigen::VectorXd q = Eigen::VectorXd::Zero(2 * n), v = q;
      for (int i = 0; i < n; ++i) {
        q[n + i] = 0.1 * (i + 1) * hx;
        v[n + i] = -1.0 * (i + 1) * hx;
      }
      const Eigen::PartialPivLU<Eigen::MatrixXd> lu(A);
      for (int step = 0; step < 25; ++step) {
        const double C = 1.0 + 0.5 * step;
        Eigen::VectorXd rhs = B * q;
        rhs.head(n) += 4.0 * ht * M * v.head(n);
        rhs.tail(n) += 4.0 * ht * M * v.tail(n) + 2.0 * ht * ht * M * f_b;
        rhs[2 * n - 1] += 2.0 * ht * ht * C;
        const Eigen::VectorXd next = lu.solve(rhs);
        v = 2.0 / ht * (next - q) - v;
        q = next;
        b->step(ht, {C, 0.0, 0.0}, hat);
        EXPECT_NEAR(b->tip_displacement(), q[2 * n - 1], 1e-10) << ht << " " << step;
        EXPECT_NEAR(b->tip_velocity(), v[2 * n - 1], 1e-10 * (1.0 + 1.0 / ht)) << ht << " " << step;
        EXPECT_NEAR(b->tip_rotation(), q[n - 1], 1e-10) << ht << " " << step;
      }
    }
  }
}

TEST(BeamStep, MidpointRuleSeesTheMeanOfForceAndLoad) {
  Parameters p = with_integrator(general_beam(10), Integrator::midpoint);
  const auto a = make_beam(p), b = make_beam(p);
  const double H = 0.05;
  const Polynomial c = {1.0, -3.0, 40.0};
  const auto mean = [H](const Polynomial& f) {
    return Polynomial{f[0] + f[1] * H / 2.0 + f[2] * H * H / 6.0, 0.0, 0.0};
  };
  Noise noise;
  const Loads loads = every_load(H, noise);
  a->step(H, c, loads);
  b->step(H, mean(c), changed(loads, mean));
  EXPECT_DOUBLE_EQ(a->tip_displacement(), b->tip_displacement());
  EXPECT_DOUBLE_EQ(a->tip_displacement_integral(), H * a->tip_displacement() / 2.0);  // u linear in time from u = 0
  EXPECT_DOUBLE_EQ(a->tip_displacement_integral_2(), H * H * a->tip_displacement() / 6.0);
}

TEST(BeamStep, MidpointRuleConvergesToTheModalSolutionInSecondOrder) {
  // All modes, a quadratic force that starts at once, a load that varies over the steps and jumps, and an impulse on
  // the way: the modal solution is exact for the same mesh. Few elements, so that the steps resolve all modes.
  for (const double alpha_b : {0.0, 0.02}) {
    std::vector<double> errors;
    for (const int steps : {800, 1600, 3200}) {
      Parameters p = alpha_b == 0.0 ? general_beam(3) : general_beam(1, 3);
      p.alpha_b = alpha_b;
      p.initial_velocity_slope = 0.4;
      const auto exact = make_beam(p), b = make_beam(with_integrator(p, Integrator::midpoint));
      const Polynomial c = {0.5, -1.0, 3.0}, f = {1.0, 10.0, -60.0};
      const double H = 1.0 / steps;
      for (int i = 0; i < steps; ++i) {
        if (i == steps / 2) {
          exact->apply_tip_impulse(0.3);
          for (const double part : {0.2, 0.1}) b->apply_tip_impulse(part);
        }
        const Loads load = i < steps / 4 ? shifted(f, i * H) : Polynomial{-2.0, 0.0, 0.0};
        exact->step(H, shifted(c, i * H), load);
        b->step(H, shifted(c, i * H), load);
      }
      errors.push_back(std::fabs(b->tip_displacement() - exact->tip_displacement()) +
                       std::fabs(b->tip_velocity() - exact->tip_velocity()));
    }
    for (std::size_t i = 0; i + 1 < errors.size(); ++i) {
      EXPECT_NEAR(std::log2(errors[i] / errors[i + 1]), 2.0, 0.1) << "α_b = " << alpha_b;
    }
  }
}

struct EnergyCase {
  Integrator integrator;
  double alpha_b;
  bool polynomial;  // exact work is at hand only for a constant force, or where the integrator uses the mean
};

TEST(BeamStep, EnergyIdentityHoldsToRounding) {
  // E(t+H) − E(t) = C̄ Δu − loss, through random forces, loads, impulses and step sizes.
  for (const EnergyCase& c :
       {EnergyCase{Integrator::modal, 0.0, false}, EnergyCase{Integrator::modal, 1e-3, false},
        EnergyCase{Integrator::midpoint, 0.0, true}, EnergyCase{Integrator::midpoint, 1e-3, true}}) {
    for (const double kappa : {1.0, 1e4}) {
      Parameters p = with_integrator(kappa == 1.0 ? general_beam(40) : general_beam(5, 8), c.integrator);
      p.young_modulus *= kappa;
      p.shear_modulus *= kappa;
      p.alpha_b = c.alpha_b;
      p.n_modes = c.integrator == Integrator::modal ? 30 : 0;
      p.initial_velocity_slope = -1.0;
      const auto b = make_beam(p);
      Noise noise;
      double worst = 0.0, largest = mechanical_energy(*b);
      for (int i = 0; i < 500; ++i) {
        if (i % 11 == 0) {
          const double v = b->tip_velocity(), before = mechanical_energy(*b), J = 0.1 * noise();
          b->apply_tip_impulse(J);
          worst = std::max(worst, std::fabs(mechanical_energy(*b) - before - 0.5 * J * (v + b->tip_velocity())));
        }
        const double H = i % 13 == 0 ? 0.003 : 0.01;
        const Polynomial force = {noise(), c.polynomial ? 10.0 * noise() : 0.0, c.polynomial ? 1e3 * noise() : 0.0};
        const double mean = force[0] + H * (force[1] / 2.0 + H * force[2] / 6.0);
        const auto total = [&b] { return mechanical_energy(*b) + b->dissipated_energy() - b->load_work(); };
        const double before = total(), u = b->tip_displacement();
        b->step(H, force, every_load(H, noise));
        const double after = total();
        worst = std::max(worst, std::fabs(after - before - mean * (b->tip_displacement() - u)));
        largest = std::max(largest, mechanical_energy(*b));
      }
      EXPECT_LT(worst, 1e-14 * largest * 10.0) << static_cast<int>(c.integrator) << " " << c.alpha_b << " " << kappa;
      if (c.alpha_b > 0.0) {
        EXPECT_GT(b->dissipated_energy(), 0.1);
      }
    }
  }
}

TEST(BeamStep, PolynomialForceDoesTheWorkThatTheIntegralsSay) {
  // ∫C u̇ dτ = C(H)u(H) − C(0)u(0) − c₁∫u − c₂(H∫u − ∫∫u), the identity that the `energy` coupling relies on.
  for (const double alpha_b : {0.0, 1e-3}) {
    Parameters p = general_beam(30);
    p.alpha_b = alpha_b;
    p.n_modes = 12;
    p.initial_velocity_slope = 1.0;
    const auto b = make_beam(p);
    Noise noise;
    const double H = 0.02;
    double worst = 0.0;
    for (int i = 0; i < 300; ++i) {
      const Polynomial c = {noise(), 50.0 * noise(), 3e3 * noise()};
      const double before = mechanical_energy(*b) + b->dissipated_energy(), u = b->tip_displacement();
      b->step(H, c, 0.0);
      const double I1 = b->tip_displacement_integral(), I2 = b->tip_displacement_integral_2();
      const double work = shifted(c, H)[0] * b->tip_displacement() - c[0] * u - c[1] * I1 - c[2] * (H * I1 - I2);
      worst = std::max(worst, std::fabs(mechanical_energy(*b) + b->dissipated_energy() - before - work));
    }
    EXPECT_LT(worst, 1e-13) << alpha_b;  // energies of 0.5 J
  }
}

TEST(BeamStep, EnergyIsConservedForThePapersStiffBeam) {
  // κ = 3.6e10, 1000 elements, H = 0.004: ω₁H = 967, 1e5 steps. Only the rounding of each
  // step adds up, and at random.
  Parameters p = unit_beam(1000, 3.6e10);
  p.n_modes = 64;
  p.initial_velocity_slope = -1.0;
  const auto modal = make_beam(p);
  const double start = mechanical_energy(*modal);
  EXPECT_NEAR(start, 1.0 / 6.0, 1e-12);
  double worst = 0.0;
  for (int i = 0; i < 100000; ++i) {
    modal->step(0.004, {0.0, 0.0, 0.0}, 0.0);
    worst = std::max(worst, std::fabs(mechanical_energy(*modal) / start - 1.0));
  }
  EXPECT_LT(worst, 1e-13);

  const auto midpoint = make_beam(with_integrator(p, Integrator::midpoint));
  worst = 0.0;
  for (int i = 0; i < 1000; ++i) {
    midpoint->step(0.004, {0.0, 0.0, 0.0}, 0.0);
    worst = std::max(worst, std::fabs(mechanical_energy(*midpoint) / start - 1.0));
  }
  EXPECT_LT(worst, 1e-12);
}

// KAG L²/EI from 1e8 to 1e18. Each of 50 steps changes the energy by no more than twice the error of the mean velocity,
// 1e-8, or is refused.
TEST(BeamStep, MidpointRuleKeepsTheEnergyOrRefusesABeamThatIsTooStiffInShear) {
  int refused = 0;
  for (const bool reduced : {false, true}) {
    for (const auto& [n, degree] : {std::pair{10, 1}, std::pair{100, 1}, std::pair{10, 3}, std::pair{100, 3}}) {
      for (double ratio = 1e8; ratio < 2e18; ratio *= 10.0) {
        Parameters p = with_integrator(unit_beam(n), Integrator::midpoint);
        p.element_degree = degree;
        p.reduced_integration = reduced;
        p.shear_modulus = ratio;
        p.initial_velocity_slope = -1.0;
        const auto b = make_beam(p);
        const double before = mechanical_energy(*b);
        try {
          for (int i = 0; i < 50; ++i) b->step(0.01, {}, {});
        } catch (const std::domain_error& error) {
          EXPECT_NE(std::string(error.what()).find("shear_modulus = "), std::string::npos) << error.what();
          EXPECT_GT(ratio * n * n, 1e20) << "half of the digits are left";
          ++refused;
        }
        EXPECT_NEAR(mechanical_energy(*b), before, 50 * 2e-8 * before) << n << " " << degree << " " << ratio;
      }
    }
  }
  EXPECT_GT(refused, 0);
}

TEST(BeamStep, AfterARefusedStepTheMidpointRuleGoesOnFromTheSameState) {
  Parameters p = with_integrator(unit_beam(100), Integrator::midpoint);
  p.shear_modulus = 1e18;
  p.reduced_integration = true;
  p.initial_velocity_slope = -1.0;
  const auto b = make_beam(p), other = make_beam(p);
  b->step(1e-6, {}, {});
  other->step(1e-6, {}, {});
  const auto before = outputs(*b);
  for (int i = 0; i < 2; ++i) EXPECT_THROW(b->step(0.01, {}, {}), std::domain_error);
  EXPECT_EQ(outputs(*b), before);
  b->step(1e-6, {}, {});
  other->step(1e-6, {}, {});
  EXPECT_EQ(outputs(*b), outputs(*other));
}

TEST(BeamStep, AccelerationIsTheDerivativeOfTheVelocity) {
  // Central difference over ±e of the exact modal motion: error e²/6·v''' ~ 1e-7 of amplitudes ~ 1e2.
  Parameters p = general_beam(8);
  p.alpha_b = 1e-3;
  p.initial_velocity_slope = 1.0;
  const double e = 1e-6;
  const auto a = make_beam(p), b = make_beam(p), c = make_beam(p);
  const Polynomial force = {0.2, 3.0, -20.0}, load = {0.4, -2.0, 30.0};
  const double t = 0.1;
  a->step(t - e, force, load);
  b->step(t, force, load);
  c->step(t + e, force, load);
  EXPECT_NEAR(b->tip_acceleration(), (c->tip_velocity() - a->tip_velocity()) / (2.0 * e),
              1e-5 * std::fabs(b->tip_acceleration()));

  // The mesh's formula M a = F − Kq − α_b K v, by both integrators, from the same state; C adds C/m_tip.
  p.initial_deflection_slope = 0.2;
  const auto modal = make_beam(p), direct = make_beam(with_integrator(p, Integrator::midpoint));
  const double without = modal->tip_acceleration();
  modal->set_forces(0.9, 0.0);
  EXPECT_NEAR(modal->tip_acceleration() - without, 0.9 / modal->tip_mass(), 1e-11 * std::fabs(without));
  modal->set_forces(0.9, 0.7);
  direct->set_forces(0.9, 0.7);
  EXPECT_NEAR(modal->tip_acceleration(), direct->tip_acceleration(), 1e-10 * std::fabs(direct->tip_acceleration()));
}

}  // namespace
}  // namespace beam
