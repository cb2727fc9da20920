// The eigenproblem: the exact frequencies of the continuous beam, completeness, and the two solvers against each other.

#include <gtest/gtest.h>

#include <Eigen/SparseCholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "beam.hpp"
#include "beam_testing.hpp"
#include "modes.hpp"
#include "timoshenko.hpp"

namespace beam {
namespace {

using testing::assembled;
using testing::clamped_free_frequencies;
using testing::frequencies;
using testing::general_beam;
using testing::modes_of;
using testing::unit_beam;

TEST(BeamModes, FrequenciesConvergeToTheExactOnesInSecondOrder) {
  const std::vector<double>& exact_frequencies = clamped_free_frequencies();
  const std::vector<double> coarse = frequencies(unit_beam(80));
  const std::vector<double> fine = frequencies(unit_beam(160));
  ASSERT_EQ(coarse.size(), 160U);
  EXPECT_NEAR(coarse[0] / exact_frequencies[0] - 1.0, 1.67e-5, 0.01e-5);
  for (std::size_t k = 0; k < exact_frequencies.size(); ++k) {
    const double e1 = coarse[k] / exact_frequencies[k] - 1.0, e2 = fine[k] / exact_frequencies[k] - 1.0;
    EXPECT_NEAR(e1 / e2, 4.0, 0.01) << k;  // from above: Rayleigh–Ritz
    // The h² term removed, (4ω_fine − ω_coarse)/3 leaves h⁴ terms, here up to 1e-8.
    EXPECT_NEAR((4.0 * fine[k] - coarse[k]) / 3.0, exact_frequencies[k], 2e-8 * exact_frequencies[k]) << k;
  }
}

// A beam too stiff to bend is a bar in shear: ω_k = (k − ½)π c/L. The averaged mass gains two orders.
TEST(BeamModes, TheAveragedMassRaisesTheOrderOfABarsFrequenciesByTwo) {
  for (const int degree : {1, 2, 3, 4}) {
    for (const MassMatrix mass : {MassMatrix::consistent, MassMatrix::averaged}) {
      Parameters p = unit_beam(0);
      p.young_modulus = 1e13;
      p.element_degree = degree;
      p.mass_matrix = mass;
      const double exact = 3.5 * std::acos(-1.0);
      std::vector<double> errors;
      for (const int refined : {1, 2}) {
        p.n_elements = refined * (degree == 1 ? 16 : degree == 4 ? 4 : 8);
        errors.push_back(frequencies(p)[3] / exact - 1.0);
      }
      const double order = std::log2(errors[0] / errors[1]);
      EXPECT_NEAR(order, 2 * degree + (mass == MassMatrix::averaged ? 2 : 0), 0.25) << degree << " " << errors[1];
    }
  }
}

// Against quadrature: 1/(p+1) of the p+1 point Gauss rule, p/(p+1) of Gauss–Lobatto, here for p = 1 and 2 by hand.
TEST(BeamModes, TheAveragedMassIsTheBlendOfTheTwoRules) {
  for (const int degree : {1, 2}) {
    Parameters p = general_beam(1, degree);
    const double h = p.length;
    const Eigen::MatrixXd consistent = assembled(Timoshenko(p), 1.0, 0.0);
    p.mass_matrix = MassMatrix::averaged;
    const Timoshenko mesh(p);
    const Eigen::MatrixXd averaged = assembled(mesh, 1.0, 0.0);
    // The tip's hat function ψ is 1 at the last node, ½ in the middle; N₂ = (P₂ − P₀)/3 is −½ there, 0 at the ends.
    const Eigen::Index tip = mesh.size() - 1;
    const double mu = p.density * p.area;
    const double lumped_tip = degree == 1 ? h / 2 : h / 6 + h * 4 / 6 * 0.25;
    const double share = 1.0 / (degree + 1);
    EXPECT_NEAR(averaged(tip, tip), share * consistent(tip, tip) + (1 - share) * mu * lumped_tip, 1e-15);
    if (degree == 2) {
      EXPECT_NEAR(averaged(1, 1), share * consistent(1, 1) + (1 - share) * mu * h * 4 / 6 * 0.25, 1e-15);
      EXPECT_NEAR(averaged(3, 1), share * consistent(3, 1) - (1 - share) * mu * h * 4 / 6 * 0.25, 1e-15);
    }
    // Products and norms are those of the matrix.
    Eigen::VectorXd x(mesh.size());
    for (Eigen::Index i = 0; i < x.size(); ++i) x[i] = std::cos(3.0 * static_cast<double>(i) + 1.0);
    const Eigen::VectorXd Mx = averaged * x;
    EXPECT_NEAR((mesh.mass_times(x) - Mx).norm(), 0.0, 1e-15);
    EXPECT_NEAR(mesh.mass_norm2(x), x.dot(Mx), 1e-14);
  }
}

TEST(BeamModes, FrequenciesScaleWithTheRootOfTheStiffness) {
  Parameters p = unit_beam(300);
  p.n_modes = 20;
  const std::vector<double> one = frequencies(p);
  p.young_modulus = p.shear_modulus = 3.6e10;
  const std::vector<double> stiff = frequencies(p);
  for (std::size_t k = 0; k < one.size(); ++k) EXPECT_NEAR(stiff[k], one[k] * std::sqrt(3.6e10), 1e-10 * stiff[k]);
}

// Number of frequencies below ω: negative pivots of K − ω²M (Sylvester's law of inertia).
int count_below(const Timoshenko& mesh, double omega) {
  const Eigen::SparseMatrix<double> shifted = assembled(mesh, -omega * omega, 1.0).sparseView();
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::NaturalOrdering<int>> ldlt(shifted);
  return static_cast<int>((ldlt.vectorD().array() < 0.0).count());
}

struct Case {
  Parameters parameters;
  const char* name;
};

std::vector<Case> cases(int n) {
  std::vector<Case> all = {{unit_beam(n), "unit"},       {unit_beam(n, 3.6e10), "stiff"},
                           {unit_beam(n), "slender"},    {unit_beam(n), "bar"},
                           {general_beam(n), "general"}, {general_beam(n / 10, 10), "degree 10"}};
  all[2].parameters.shear_modulus = 1e6;
  all[2].parameters.reduced_integration = true;
  all[3].parameters.young_modulus = 1e6;
  return all;
}

TEST(BeamModes, LanczosMissesNoMode) {
  for (Case c : cases(600)) {
    c.parameters.n_modes = 40;
    const Timoshenko mesh(c.parameters);
    const Modes modes = compute_modes(mesh, c.parameters.n_modes);
    EXPECT_LT(modes.residual, 1e-8) << c.name;
    for (const Eigen::Index k : {1, 7, 39}) {
      const double between = 0.5 * (modes.omega[k - 1] + modes.omega[k]);
      EXPECT_EQ(count_below(mesh, between), k) << c.name;
    }
  }
}

TEST(BeamModes, LanczosAndDenseDecompositionAgree) {
  for (Case c : cases(110)) {
    const Timoshenko mesh(c.parameters);
    c.parameters.n_modes = 0;
    const Modes all = compute_modes(mesh, c.parameters.n_modes);  // singular values of a 220 × 220 matrix
    EXPECT_LT(all.residual, 1e-9) << c.name;
    c.parameters.n_modes = 12;
    const Modes few = compute_modes(mesh, c.parameters.n_modes);  // Lanczos
    for (Eigen::Index k = 0; k < 12; ++k) {
      EXPECT_NEAR(few.omega[k], all.omega[k], 1e-10 * all.omega[k]) << c.name << k;
      // Eigenvectors: error of the Krylov vectors over the relative gap of neighbouring modes.
      EXPECT_NEAR(few.loads[Loads::tip][k], all.loads[Loads::tip][k], 1e-8 * std::fabs(all.loads[Loads::tip][k]))
          << c.name << k;
    }
  }
}

TEST(BeamModes, AllModesSpanTheMesh) {
  for (const Case& c : cases(60)) {
    const Timoshenko mesh(c.parameters);
    const Modes modes = compute_modes(mesh, c.parameters.n_modes);
    ASSERT_EQ(modes.omega.size(), 120);
    // Σ φφᵀ = M⁻¹, applied to the tip and to u = x.
    const double inverse_mass = mesh.tip(mesh.mass_solve(mesh.load(Loads::tip)));
    EXPECT_NEAR(modes.loads[Loads::tip].squaredNorm(), inverse_mass, 1e-11 * inverse_mass) << c.name;
    EXPECT_NEAR(modes.loads[Loads::tip].dot(modes.start), c.parameters.length, 1e-11) << c.name;
    EXPECT_EQ(count_below(mesh, modes.omega[119] * (1.0 + 1e-6)), 120) << c.name;
    EXPECT_LT(count_below(mesh, modes.omega[119] * (1.0 - 1e-6)), 120) << c.name;
  }
}

TEST(BeamModes, ReducedBasisKeepsTheInitialState) {
  // u⁰ = s x and u_t⁰ = s' x exactly, for any number of modes: energies ½KAG s²L and ½ρA s'²L³/3.
  for (const int n_modes : {1, 5, 64}) {
    Parameters p = general_beam(400);
    p.n_modes = n_modes;
    p.initial_deflection_slope = 0.2;
    p.initial_velocity_slope = -1.5;
    const auto b = make_beam(p);
    const double L = p.length, KAG = p.shear_modulus * p.shear_coefficient * p.area, rho_A = p.density * p.area;
    EXPECT_NEAR(b->tip_displacement(), 0.2 * L, 1e-12);
    EXPECT_NEAR(b->tip_velocity(), -1.5 * L, 1e-12);
    EXPECT_NEAR(b->strain_energy(), 0.5 * KAG * 0.04 * L, 1e-11);
    EXPECT_NEAR(b->kinetic_energy(), 0.5 * rho_A * 2.25 * L * L * L / 3.0, 1e-12);
    const Shape u = b->deflection(), theta = b->rotation();
    for (int j = 0; j < shape_points; ++j) {
      EXPECT_NEAR(u[j], 0.2 * L * j / 20.0, 1e-12);
      EXPECT_NEAR(theta[j], 0.0, 1e-11);
    }
  }
}

// Basis, tip mass and responses are properties of the mesh and n_modes: no start changes them.
TEST(BeamModes, StartsDoNotChangeTheBasis) {
  for (const int n_modes : {1, 7, 64}) {
    Parameters p = unit_beam(1000, 3.6e10);
    p.n_modes = n_modes;
    const auto plain = make_beam(p);
    for (double Parameters::*const field :
         {&Parameters::initial_deflection_slope, &Parameters::initial_velocity_slope}) {
      for (const double value : {1e-300, -6.0}) {
        Parameters q = p;
        q.*field = value;
        const auto other = make_beam(q);
        EXPECT_EQ(frequencies(q), frequencies(p)) << n_modes;
        EXPECT_EQ(other->tip_mass(), plain->tip_mass()) << n_modes;
        const Beam::TipResponse found = other->tip_response(1e-4), expected = plain->tip_response(1e-4);
        for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(found[i], expected[i], 1e-12 * expected[i]) << n_modes;
      }
    }
  }
}

TEST(BeamModes, NearlyAllModesLeaveLittleToAdd) {
  for (const int n : {1, 2, 3, 6}) {
    for (int n_modes = std::max(1, 2 * n - 5); n_modes <= 2 * n; ++n_modes) {
      Parameters p = general_beam(n);
      p.n_modes = n_modes;
      p.initial_velocity_slope = 1.0;
      const std::vector<double> reduced = frequencies(p);
      EXPECT_LE(reduced.size(), static_cast<std::size_t>(2 * n));
      p.n_modes = 0;
      const std::vector<double> all = frequencies(p);
      for (std::size_t k = 0; k < static_cast<std::size_t>(n_modes); ++k)
        EXPECT_NEAR(reduced[k], all[k], 1e-11 * all[k]);
      if (reduced.size() == all.size()) {
        EXPECT_NEAR(reduced.back(), all.back(), 1e-9 * all.back());  // the static shapes complete the space
      }
    }
  }
}

TEST(BeamModes, AThousandElementsHaveTheModesAsked) {
  Parameters p = unit_beam(1000, 3.6e10);
  p.n_modes = 64;
  EXPECT_EQ(modes_of(p).omega.size(), 67);  // 64 modes, the shapes of tip force, uniform load and start
}

// Moment at the clamp and shear force half-way of the first modes, per tip deflection, against the continuous beam
// (θ' = M, u' = Q + θ, M' = −Q − ω²θ, Q' = −ω²u, by Runge–Kutta): internal forces are as accurate as the frequencies.
TEST(InternalForces, OfTheFirstModesConvergeWithTwiceTheDegree) {
  using State = std::array<double, 4>;  // θ, u, M, Q
  const auto exact = [](double omega) {
    const double w2 = omega * omega;
    const auto slope = [w2](const State& s) { return State{s[2], s[3] + s[0], -s[3] - w2 * s[0], -w2 * s[1]}; };
    const auto end = [&](State s, int to) {
      constexpr int steps = 2000;
      for (int i = 0; i < to * steps / 2; ++i) {
        const double h = 1.0 / steps;
        const auto add = [](const State& a, double f, const State& b) {
          return State{a[0] + f * b[0], a[1] + f * b[1], a[2] + f * b[2], a[3] + f * b[3]};
        };
        const State k1 = slope(s), k2 = slope(add(s, h / 2, k1)), k3 = slope(add(s, h / 2, k2)),
                    k4 = slope(add(s, h, k3));
        s = add(add(add(add(s, h / 6, k1), h / 3, k2), h / 3, k3), h / 6, k4);
      }
      return s;
    };
    const State m = end({0, 0, 1, 0}, 2), q = end({0, 0, 0, 1}, 2);
    const double Q0 = -m[2] / q[2];  // M(L) = 0
    const double tip = m[1] + Q0 * q[1];
    return std::array<double, 2>{1.0 / tip, end({0, 0, 1, Q0}, 1)[3] / tip};
  };
  for (const int degree : {1, 2}) {
    for (const int mode : {0, 1}) {
      std::array<std::array<double, 2>, 2> errors{};
      const auto expected = exact(clamped_free_frequencies()[static_cast<std::size_t>(mode)]);
      for (const int fine : {0, 1}) {
        Parameters p;
        p.n_elements = (degree == 1 ? 20 : 10) << fine;
        p.element_degree = degree;
        const Modes modes = compute_modes(Timoshenko(p), p.n_modes);
        const double scale = -modes.omega[mode] * modes.omega[mode] / modes.loads[Loads::tip][mode];  // a = −ω² η
        errors[fine] = {std::abs(-scale * modes.moments(0, mode) - expected[0]),
                        std::abs(-scale * modes.shears(10, mode) - expected[1])};
      }
      for (const int i : {0, 1})
        EXPECT_NEAR(std::log2(errors[0][i] / errors[1][i]), 2.0 * degree, 0.3) << degree << mode;
    }
  }
}

TEST(BeamModes, AreFoundToRoundingWhereShearIsTenPowersOfTenStiffer) {
  Parameters p;
  p.second_moment_of_area = 1e-5;
  p.young_modulus = 1.5e-6;
  p.shear_modulus = 650.0;
  for (const int degree : {1, 2, 4}) {
    p.n_elements = 1;
    p.element_degree = degree;
    const Modes modes = compute_modes(Timoshenko(p), p.n_modes);
    const double rounding = std::numeric_limits<double>::epsilon() * modes.omega.maxCoeff() / modes.omega.minCoeff();
    EXPECT_LT(modes.residual, 10.0 * rounding) << degree;
  }
}

}  // namespace
}  // namespace beam
