// The exact modes: against the mesh, by their count, and in the limits that are known.

#include <gtest/gtest.h>

#include <cmath>

#include "beam_testing.hpp"
#include "exact_modes.hpp"

namespace beam {
namespace {

using testing::general_beam;
using testing::unit_beam;

Parameters without_mesh(Parameters p, int n_modes) {
  p.n_elements = 0;
  p.element_degree = 1;
  p.n_modes = n_modes;
  return p;
}

/// EI and KAG of a beam of ρA = L = 1; thick, slender, and a bar in shear.
struct Kind {
  double bending, shear, second_moment;
};
const std::array<Kind, 4> kinds{{{1.0, 1.0, 1.0}, {1.0, 1e6, 1e-6}, {1e8, 1.0, 1.0}, {1.0, 1e6, 1.0}}};

Parameters beam_of(const Kind& kind) {
  Parameters p = unit_beam(1);
  p.second_moment_of_area = kind.second_moment;
  p.young_modulus = kind.bending / kind.second_moment;
  p.shear_modulus = kind.shear;
  return p;
}

TEST(ExactModes, AreThoseOfFineElementsOfHighDegree) {
  Parameters p = general_beam(24, 12);
  p.n_modes = 20;
  const Modes mesh = compute_modes(Timoshenko(p), p), exact = exact_modes(without_mesh(p, 20));
  for (Eigen::Index k = 0; k < 20; ++k) {
    EXPECT_NEAR(exact.omega[k], mesh.omega[k], 1e-12 * mesh.omega[k]) << k;
    EXPECT_NEAR(exact.tip_rotation[k], mesh.tip_rotation[k], 1e-9 * std::abs(mesh.tip_rotation[k])) << k;
    EXPECT_LT((exact.deflection.col(k) - mesh.deflection.col(k)).topRows(shape_points - 1).norm(), 1e-9) << k;
    EXPECT_LT((exact.rotation.col(k) - mesh.rotation.col(k)).norm(), 1e-9 * mesh.rotation.col(k).norm()) << k;
  }
}

// Wittrick & Williams: below every frequency are as many as its number says, just above it one more.
TEST(ExactModes, NoneIsMissed) {
  for (const Kind& kind : kinds) {
    const Parameters p = without_mesh(beam_of(kind), 4000);
    const Modes modes = exact_modes(p);
    for (int k = 0; k < 4000; ++k) {
      ASSERT_EQ(exact_mode_count(p, modes.omega[k] * (1.0 - 1e-13)), k) << kind.shear << " " << kind.bending;
      ASSERT_EQ(exact_mode_count(p, modes.omega[k] * (1.0 + 1e-13)), k + 1) << kind.shear << " " << kind.bending;
    }
  }
}

// Too stiff to bend, it is a bar: ω_k = (k − ½)π, φ_k(L)² = 2/ρAL; ∫sin and ∫x sin of its modes are known too.
TEST(ExactModes, BecomeThoseOfABar) {
  Parameters p = unit_beam(1);
  p.young_modulus = 1e13;
  const Modes modes = exact_modes(without_mesh(p, 100));
  for (Eigen::Index k = 0; k < 8; ++k) {
    const double wave = (static_cast<double>(k) + 0.5) * std::acos(-1.0), sign = k % 2 == 0 ? 1.0 : -1.0;
    EXPECT_NEAR(modes.omega[k], wave, 1e-12 * wave);
    EXPECT_NEAR(modes.tip[k], std::sqrt(2.0), 1e-3) << k;  // the other modes' share is the bar's (k/100)⁴
    EXPECT_NEAR(modes.loads[Loads::distributed][k], sign * std::sqrt(2.0) / wave, 1e-4) << k;
    EXPECT_NEAR(modes.linear_shape[k], std::sqrt(2.0) / (wave * wave), 1e-5) << k;
  }
}

TEST(ExactModes, StaticTipDeflectionIsExactForAnyNumberOfThem) {
  for (const Kind& kind : kinds) {
    for (const int n_modes : {1, 10, 1000}) {
      const Modes modes = exact_modes(without_mesh(beam_of(kind), n_modes));
      const Eigen::VectorXd compliance = modes.tip.cwiseQuotient(modes.omega.cwiseAbs2());
      const auto expect = [&](const Eigen::VectorXd& load, double exact) {
        EXPECT_NEAR(load.dot(compliance), exact, 1e-13 * std::abs(exact)) << n_modes << " " << kind.shear;
      };
      expect(modes.loads[Loads::tip], 1.0 / (3.0 * kind.bending) + 1.0 / kind.shear);
      expect(modes.loads[Loads::distributed], 1.0 / (8.0 * kind.bending) + 0.5 / kind.shear);
      expect(modes.loads[Loads::distributed + 1], 11.0 / (120.0 * kind.bending) + 1.0 / (3.0 * kind.shear));
      expect(modes.loads[Loads::point], 5.0 / (48.0 * kind.bending) + 0.5 / kind.shear);
      EXPECT_NEAR(modes.linear_shape.dot(modes.tip), 1.0, 1e-13);
    }
  }
}

TEST(ExactModes, AStartThatTheModesDoNotHoldIsRefused) {
  Parameters p = without_mesh(unit_beam(1), 1);
  EXPECT_NO_THROW(exact_modes(p));
  p.initial_velocity_slope = -1.0;
  EXPECT_THROW(exact_modes(p), std::invalid_argument);
}

// Where numbers overflow, no frequency is ever bracketed.
TEST(ExactModes, ParametersOutOfRangeAreRefused) {
  for (const double length : {1e70, 1e100, 1e200, 1e-70, 1e-200}) {
    Parameters p = without_mesh(unit_beam(1), 5);
    p.length = length;
    EXPECT_THROW(exact_modes(p), std::runtime_error) << length;
  }
}

}  // namespace
}  // namespace beam
