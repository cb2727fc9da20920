// Elements of degree 1 … 12: the forms against quadrature, exact statics, order 2p of the frequencies.

#include <gtest/gtest.h>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "beam.hpp"
#include "beam_testing.hpp"
#include "timoshenko.hpp"

namespace beam {
namespace {

using testing::bending;
using testing::clamped_free_frequencies;
using testing::frequencies;
using testing::general_beam;
using testing::mesh_tip_compliance;
using testing::Noise;
using testing::shearing;
using testing::static_tip_compliance;
using testing::unit_beam;
using testing::with_integrator;

Parameters of_degree(Parameters p, int degree) {
  p.element_degree = degree;
  return p;
}

/// P_k(ξ) and its derivative by Bonnet's recursion.
std::array<double, 2> legendre(int k, double xi) {
  double before = 0.0, value = 1.0, slope_before = 0.0, slope = 0.0;
  for (int j = 1; j <= k; ++j) {
    const double next = ((2 * j - 1) * xi * value - (j - 1) * before) / j;
    const double slope_next = slope_before + (2 * j - 1) * value;
    before = value;
    value = next;
    slope_before = slope;
    slope = slope_next;
  }
  return {value, slope};
}

/// Gauss–Legendre nodes and weights on (−1, 1): Newton's method from cos(π(i + ¾)/(m + ½)).
std::vector<std::array<double, 2>> gauss(int m) {
  std::vector<std::array<double, 2>> rule;
  for (int i = 0; i < m; ++i) {
    double xi = std::cos(M_PI * (i + 0.75) / (m + 0.5));
    for (int k = 0; k < 20; ++k) xi -= legendre(m, xi)[0] / legendre(m, xi)[1];
    const double slope = legendre(m, xi)[1];
    rule.push_back({xi, 2.0 / ((1.0 - xi * xi) * slope * slope)});
  }
  return rule;
}

/// θ̃, u and their derivatives by x at ξ in element e, from the definition of the basis.
struct Point {
  double theta, u, theta_x, u_x;
};
Point evaluate(const Parameters& p, const Eigen::VectorXd& q, int e, double xi) {
  const int block = 2 * p.element_degree;
  const double h = p.length / p.n_elements;
  double value[2], slope[2];
  for (int f = 0; f < 2; ++f) {
    const double left = e > 0 ? q[e * block - 2 + f] : 0.0, right = q[e * block + block - 2 + f];
    value[f] = 0.5 * (1.0 - xi) * left + 0.5 * (1.0 + xi) * right;
    slope[f] = (right - left) / h;
    for (int k = 2; k <= p.element_degree; ++k) {
      const double c = q[e * block + 2 * (k - 2) + f];
      value[f] += c * (legendre(k, xi)[0] - legendre(k - 2, xi)[0]) / (2 * k - 1);
      slope[f] += c * legendre(k - 1, xi)[0] * 2.0 / h;
    }
  }
  return {value[0], value[1], slope[0], slope[1]};
}

Eigen::VectorXd noise(Eigen::Index size) {
  Noise random;
  Eigen::VectorXd x(size);
  for (double& value : x) value = random();
  return x;
}

double dot(const Eigen::VectorXd& a, const Eigen::VectorXd& b) { return a.dot(b); }

TEST(BeamDegree, FormsAreTheIntegralsOfTheirDefinition) {
  for (int degree = 1; degree <= max_element_degree; ++degree) {
    for (const int n : {1, 3}) {
      for (const bool reduced : {false, true}) {
        Parameters p = general_beam(n, degree);
        p.reduced_integration = reduced;
        const Timoshenko mesh(p);
        ASSERT_EQ(mesh.size(), 2 * n * degree);
        const Eigen::VectorXd q = noise(mesh.size());
        const double h = p.length / n, r = std::sqrt(p.second_moment_of_area / p.area);
        double mass = 0.0, bending = 0.0, shear = 0.0, hat = 0.0;
        std::array<double, Loads::point> distributed{};
        for (int e = 0; e < n; ++e) {
          for (const auto& [xi, w] : gauss(degree + 1)) {  // exact to degree 2p + 1
            const Point at = evaluate(p, q, e, xi);
            mass += 0.5 * h * w * (at.theta * at.theta + at.u * at.u);
            bending += 0.5 * h * w * at.theta_x * at.theta_x;
            if (!reduced) shear += 0.5 * h * w * std::pow(at.u_x - at.theta / r, 2);
            if (e == n - 1) hat += 0.5 * h * w * 0.5 * (1.0 + xi) * at.u;
          }
          for (const auto& [xi, w] : gauss(degree + 2)) {
            const double x = (e + 0.5 + 0.5 * xi) / n;
            double power = 0.5 * h * w * evaluate(p, q, e, xi).u;
            for (double& work : distributed) {
              work += power;
              power *= x;
            }
          }
          if (reduced) {
            for (const auto& [xi, w] : gauss(degree)) {
              const Point at = evaluate(p, q, e, xi);
              shear += 0.5 * h * w * std::pow(at.u_x - at.theta / r, 2);
            }
          }
        }
        mass *= p.density * p.area;
        const double stiffness = p.area * (p.young_modulus * bending + p.shear_modulus * p.shear_coefficient * shear);
        const double rounding = 1e-13;  // sums of a few hundred terms of one sign
        EXPECT_NEAR(mesh.mass_norm2(q), mass, rounding * mass) << degree;
        EXPECT_NEAR(dot(q, mesh.mass_times(q)), mass, rounding * mass) << degree;
        EXPECT_NEAR(mesh.stiffness_norm2(q), stiffness, rounding * stiffness) << degree;
        EXPECT_NEAR(dot(q, mesh.stiffness_times(q)), stiffness, rounding * stiffness) << degree;
        for (std::size_t i = 0; i < distributed.size(); ++i) {
          EXPECT_NEAR(mesh.load(i).dot(q), distributed[i], 1e-14 * degree) << degree << " " << i;
        }
        EXPECT_NEAR(mesh.load(Loads::hat).dot(q), hat, 1e-14 * degree) << degree;

        const Eigen::VectorXd Mq = mesh.mass_times(q), Kq = mesh.stiffness_times(q);
        Eigen::VectorXd both = 0.3 * Mq + 2.0 * Kq;
        mesh.factors(0.3, 2.0).solve_in_place(both);
        EXPECT_LT((both - q).norm(), 1e-11 * q.norm()) << degree;
        // Relative to q: ε times the condition of the strains' map, at most p² n here.
        const Eigen::VectorXd same = mesh.flexibility_times(Kq);
        EXPECT_LT((same - q).norm(), 1e-12 * q.norm()) << degree;
        EXPECT_LT((mesh.mass_solve(Mq) - q).norm(), 1e-12 * q.norm()) << degree;

        const Shape u = mesh.deflection(q), theta = r * mesh.rotation(q);
        for (int j = 0; j < shape_points; ++j) {
          const int e = std::min(n - 1, j * n / (shape_points - 1));
          const Point at = evaluate(p, q, e, 2.0 * (static_cast<double>(j * n) / (shape_points - 1) - e) - 1.0);
          EXPECT_NEAR(u[j], at.u, 1e-14) << degree;
          EXPECT_NEAR(theta[j], at.theta, 1e-14) << degree;
        }
      }
    }
  }
}

TEST(BeamDegree, OneElementHasTheExactTipComplianceFromDegreeThree) {
  // The static shape under a tip force has θ of degree 2 and u of degree 3, so it lies in the space from p = 3 on; with
  // p Gauss points the moment need only be linear, p = 2. Full integration at p = 2 stiffens the linear part of the
  // moment, −h/2 P_1 in each element, by 1 + f, f = KAG h²/60EI: L³/3 loses (L h²/12) f/(1 + f).
  for (const double shear_modulus : {1.0, 1e6}) {
    for (int degree = 2; degree <= max_element_degree; ++degree) {
      for (const int n : {1, 4}) {
        for (const bool reduced : {false, true}) {
          Parameters p = general_beam(n, degree);
          p.shear_modulus *= shear_modulus;
          p.reduced_integration = reduced;
          const double L = p.length, h = L / n, EI = bending(p), KAG = shearing(p);
          double exact = L * L * L / (3.0 * EI) + L / KAG;
          if (degree == 2 && !reduced) {
            const double f = KAG * h * h / (60.0 * EI);
            exact -= L * h * h / (12.0 * EI) * f / (1.0 + f);
          }
          for (const int n_modes : {0, 1, 3}) {
            p.n_modes = n_modes;
            // Rounding of the modes' sum: ε ω_max/ω₁, ω_max/ω₁ up to some p² n √(KAG/EI).
            const double tolerance = n_modes == 0 && shear_modulus > 1.0 ? 1e-10 : 1e-12;
            EXPECT_NEAR(static_tip_compliance(p), exact, tolerance * exact) << degree << " " << n;
          }
          EXPECT_NEAR(mesh_tip_compliance(p), exact, 1e-13 * exact) << degree << " " << n;
        }
      }
    }
  }
}

TEST(BeamDegree, LoadsLiftTheTipExactlyFromDegreeFour) {
  // u(L) is the work of the load on the shape of a unit tip force, w(x) = (L x²/2 − x³/6)/EI + x/KAG, which is then in
  // the space. One degree less suffices with p Gauss points.
  for (int degree = 3; degree <= max_element_degree; ++degree) {
    for (const bool reduced : {false, true}) {
      if (degree == 3 && !reduced) continue;
      Parameters p = general_beam(2, degree);
      p.reduced_integration = reduced;
      p.point_force_position = {0.0, 0.3, 0.5, 1.0};
      const Timoshenko mesh(p);
      const double L = p.length, mu = p.density * p.area;
      const auto tip = [&](std::size_t load) { return mesh.tip(mesh.flexibility_times(mesh.load(load))); };
      std::array<double, Loads::hat> exact{};
      for (std::size_t k = 0; k < Loads::point; ++k) {
        const double power = static_cast<double>(k);
        exact[k] = std::pow(L, 4) * (0.5 / (power + 3.0) - 1.0 / (6.0 * (power + 4.0))) / bending(p) +
                   L * L / ((power + 2.0) * shearing(p));
      }
      const auto w = [&](double x) { return (L * x * x / 2.0 - x * x * x / 6.0) / bending(p) + x / shearing(p); };
      for (std::size_t i = 0; i < 4; ++i) exact[Loads::point + i] = w(L * p.point_force_position[i]);
      exact[Loads::tip] = w(L);
      exact[Loads::base_acceleration] = -mu * exact[0];
      for (std::size_t i = 0; i < exact.size(); ++i) {
        EXPECT_NEAR(tip(i), exact[i], 1e-13 * std::abs(exact[Loads::tip])) << degree << " " << Loads::names[i];
      }
    }
  }
}

TEST(BeamDegree, FrequenciesConvergeWithTwiceTheDegree) {
  const std::vector<double>& exact = clamped_free_frequencies();
  struct Mesh {
    int degree, coarse, fine;
  };
  // Meshes whose errors lie between the pre-asymptotic range and rounding (1e-13).
  for (const Mesh& mesh : {Mesh{1, 80, 160}, Mesh{2, 16, 32}, Mesh{3, 8, 16}, Mesh{4, 6, 9}, Mesh{5, 4, 6}}) {
    for (const bool reduced : {false, true}) {
      Parameters p = of_degree(unit_beam(mesh.coarse), mesh.degree);
      p.reduced_integration = reduced;
      const std::vector<double> coarse = frequencies(p);
      p.n_elements = mesh.fine;
      const std::vector<double> fine = frequencies(p);
      for (const std::size_t k : {2U, 3U}) {
        const double e1 = coarse[k] / exact[k] - 1.0, e2 = fine[k] / exact[k] - 1.0;
        const double order =
            std::log(e1 / e2) / std::log(static_cast<double>(mesh.fine) / static_cast<double>(mesh.coarse));
        EXPECT_NEAR(order, 2.0 * mesh.degree, 0.08 * mesh.degree) << mesh.degree << " " << k << " " << reduced;
        if (!reduced) {
          EXPECT_GT(e2, 0.0);  // from above: Rayleigh–Ritz
        }
      }
    }
  }
}

TEST(BeamDegree, OneElementOfHighDegreeHasTheExactFrequencies) {
  // The modes are entire functions: the error falls faster than any power of p, to rounding ε ω_max/ω = 1e-13.
  const std::vector<double>& exact = clamped_free_frequencies();
  double previous = 1.0;
  for (const int degree : {4, 6, 8, 10}) {
    const std::vector<double> one = frequencies(of_degree(unit_beam(1), degree));
    const double error = std::fabs(one[3] / exact[3] - 1.0);
    EXPECT_LT(error, 0.03 * previous) << degree;
    previous = error;
  }
  const std::vector<double> twelve = frequencies(of_degree(unit_beam(1), 12));
  for (const std::size_t k : {0U, 1U, 2U, 3U}) EXPECT_NEAR(twelve[k], exact[k], 1e-11 * exact[k]) << k;
}

TEST(BeamDegree, SlenderBeamsDoNotLockFromDegreeThree) {
  // KAG/EI = 1e6, ρI = 1e-6 ρA: Euler–Bernoulli's 1.8751041² rad/s less 4.7e-6 of it for shear and rotary inertia;
  // zero of the determinant of `clamped_free_frequencies` with these constants. Degree 1 locks by 72; from then on each
  // degree gains, and p Gauss points for the shear are as good as one degree more.
  const double exact = 3.515998926987939;
  Parameters p = unit_beam(4);
  p.second_moment_of_area = 1e-6;
  p.young_modulus = 1e6;
  p.shear_modulus = 1e6;
  const auto error = [&](int degree, bool reduced) {
    Parameters mesh = of_degree(p, degree);
    mesh.reduced_integration = reduced;
    return frequencies(mesh)[0] / exact - 1.0;
  };
  EXPECT_GT(error(1, false), 70.0);
  EXPECT_NEAR(error(2, false), 1.22e-2, 0.01e-2);
  EXPECT_NEAR(error(3, false), 3.26e-5, 0.01e-5);
  EXPECT_NEAR(error(4, false), 6.9e-8, 0.1e-8);
  EXPECT_NEAR(error(1, true), 7.08e-3, 0.01e-3);
  EXPECT_NEAR(error(2, true), 1.01e-4, 0.01e-4);
  EXPECT_NEAR(error(3, true), 4.3e-8, 0.1e-8);
  EXPECT_NEAR(error(5, false), 0.0, 1e-10);
}

TEST(BeamDegree, TheTipMassOfOneElement) {
  // min ∫v² over polynomials of degree p with v(0) = 0, v(L) = 1 is L/(p(p + 2)): the reproducing kernel of P_p,
  // k(±1,1) = (p + 1)²/2 and (−1)^p (p + 1)/2, reduced by the clamp to k(1,1) − k(−1,1)²/k(−1,−1) = p(p + 2)/2.
  for (int degree = 1; degree <= max_element_degree; ++degree) {
    for (const Integrator integrator : {Integrator::modal, Integrator::midpoint}) {
      const Parameters p = with_integrator(general_beam(1, degree), integrator);
      const double exact = p.density * p.area * p.length / (degree * (degree + 2));
      EXPECT_NEAR(make_beam(p)->tip_mass(), exact, 1e-12 * exact) << degree;
    }
  }
}

TEST(BeamDegree, TheStartIsExactAtAnyDegree) {
  for (const int degree : {1, 2, 5, 12}) {
    for (const int n_modes : {0, 2}) {
      for (const Integrator integrator : {Integrator::modal, Integrator::midpoint}) {
        Parameters p = with_integrator(general_beam(3, degree), integrator);
        p.n_modes = n_modes;
        p.initial_deflection_slope = 0.2;
        p.initial_velocity_slope = -1.5;
        const auto b = make_beam(p);
        const double L = p.length;
        EXPECT_NEAR(b->strain_energy(), 0.5 * shearing(p) * 0.04 * L, 1e-11);
        EXPECT_NEAR(b->kinetic_energy(), 0.5 * p.density * p.area * 2.25 * L * L * L / 3.0, 1e-11);
        EXPECT_NEAR(b->tip_velocity(), -1.5 * L, 1e-12);
        const Shape u = b->deflection();
        for (int j = 0; j < shape_points; ++j) {
          EXPECT_NEAR(u[j], 0.2 * L * j / 20.0, 1e-12) << degree;
        }
      }
    }
  }
}

}  // namespace
}  // namespace beam
