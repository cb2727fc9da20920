// Statics of the discrete beam: closed forms of the P1/P1 element with full and with reduced integration.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "beam.hpp"
#include "beam_testing.hpp"
#include "timoshenko.hpp"

namespace beam {
namespace {

using testing::bending;
using testing::every_load;
using testing::general_beam;
using testing::mesh_tip_compliance;
using testing::Noise;
using testing::shearing;
using testing::static_tip_compliance;
using testing::unit_beam;
using testing::variants;
using testing::with_integrator;

/// u(L) of the discrete beam under a unit tip force. In element e the moment is M_e = L − x_mid; with
/// Σ h M_e² = L³/3 − L h²/12:
///   full integration     (L³/3EI + L/KAG)/(1 + KAG h²/12EI)
///   reduced integration  (L³/3 − L h²/12)/EI + L/KAG
double tip_compliance(const Parameters& p) {
  const double L = p.length, h = L / p.n_elements, EI = bending(p), KAG = shearing(p);
  if (p.reduced_integration) return (L * L * L / 3.0 - L * h * h / 12.0) / EI + L / KAG;
  return (L * L * L / (3.0 * EI) + L / KAG) / (1.0 + KAG * h * h / (12.0 * EI));
}

std::vector<Parameters> meshes() {
  std::vector<Parameters> all;
  for (const int n : {1, 2, 10, 37, 100}) {
    for (const bool reduced : {false, true}) {
      for (Parameters p : {unit_beam(n), unit_beam(n, 3.6e10), general_beam(n)}) {
        p.reduced_integration = reduced;
        all.push_back(p);
      }
      Parameters slender = unit_beam(n);
      slender.shear_modulus = 1e6;
      slender.reduced_integration = reduced;
      all.push_back(slender);
    }
  }
  return all;
}

TEST(BeamStatics, TipComplianceIsThatOfTheMeshForAnyNumberOfModes) {
  for (Parameters p : meshes()) {
    const double exact = tip_compliance(p);
    for (const int n_modes : {1, 2, 7, 30, 0}) {
      if (n_modes > 2 * p.n_elements) continue;
      p.n_modes = n_modes;
      // Rounding, of sums over the mesh and over the modes; of all modes, ε ω_max/ω₁ with up to 4e5.
      const double tolerance = n_modes == 0 ? 1e-11 : 1e-12;
      EXPECT_NEAR(static_tip_compliance(p), exact, tolerance * exact) << p.n_elements << " " << n_modes;
    }
    EXPECT_NEAR(mesh_tip_compliance(p), exact, 1e-13 * exact);
  }
}

TEST(BeamStatics, FullIntegrationLocksAndReducedDoesNot) {
  Parameters p = unit_beam(10);
  p.shear_modulus = 1e6;
  const double truth = 1.0 / 3.0 + 1e-6;
  EXPECT_NEAR(static_tip_compliance(p) / truth, 0.0012, 5e-6);  // 1/(1 + 1e6/1200) = 0.00119856
  p.reduced_integration = true;
  EXPECT_NEAR(static_tip_compliance(p) / truth, 0.9975, 1e-8);  // 1 − h²/4
}

// A large Kelvin–Voigt damping and a long step end in equilibrium. The midpoint rule hardly damps fast modes: it stays
// where it is put at rest.
TEST(BeamStatics, MotionComesToRestInTheStaticShape) {
  for (const bool reduced : {false, true}) {
    for (const int n_modes : {1, 5, 0}) {
      Parameters p = general_beam(20);
      p.reduced_integration = reduced;
      p.n_modes = n_modes;
      p.alpha_b = 0.3;
      const double C = 0.7, L = p.length, h = L / p.n_elements;
      const double EI = bending(p) + (reduced ? 0.0 : shearing(p) * h * h / 12.0);
      for (const Integrator integrator : {Integrator::modal, Integrator::midpoint}) {
        const auto b = make_beam(with_integrator(p, integrator));
        b->set_forces(C, {});
        if (integrator == Integrator::midpoint) b->put_at_rest();
        b->step(300.0, {C, 0.0, 0.0}, 0.0);  // what is left of the modal motion is e^{−t ω₁²α/2} ~ 1e-200
        EXPECT_NEAR(b->tip_displacement(), C * tip_compliance(p), 1e-12 * C * tip_compliance(p));
        EXPECT_NEAR(b->strain_energy(), 0.5 * C * C * tip_compliance(p), 1e-12 * C * C * tip_compliance(p));
        EXPECT_NEAR(b->tip_velocity(), 0.0, 1e-12);
        EXPECT_NEAR(b->tip_acceleration(), 0.0, 1e-7);  // forces in balance up to rounding of KAG/h u/(ρA h)
        // θ(L) = Σ h (L − x_mid)/EI = L²/2EI; the static shape is in the basis, so this too holds for any n_modes.
        EXPECT_NEAR(b->tip_rotation(), C * L * L / (2.0 * EI), 1e-12);
        const Shape u = b->deflection(), theta = b->rotation();
        EXPECT_EQ(u[0], 0.0);
        EXPECT_EQ(theta[0], 0.0);
        EXPECT_NEAR(u[20], b->tip_displacement(), 1e-14);
        EXPECT_NEAR(theta[20], b->tip_rotation(), 1e-14);
        for (int j = 0; j <= 20; ++j) {  // 20 elements: every output point is a node
          const double x = L * j / 20.0, shape = (L * x - 0.5 * x * x) / EI;
          EXPECT_NEAR(theta[j], C * shape, 1e-12) << j;
        }
      }
    }
  }
}

TEST(BeamStatics, PutAtRestItStaysThere) {
  for (const Parameters& p : variants()) {
    const auto b = make_beam(p), moving = make_beam(p);
    for (Beam* one : {b.get(), moving.get()}) one->step(0.01, {0.3, 2.0, -50.0}, 0.1);
    b->set_forces(0.7, 0.4);
    b->put_at_rest();
    const double u = b->tip_displacement();
    EXPECT_NEAR(b->tip_acceleration(), 0.0, 1e-9);
    EXPECT_EQ(b->dissipated_energy(), moving->dissipated_energy());
    EXPECT_EQ(b->load_work(), moving->load_work());
    b->step(0.05, {0.7, 0.0, 0.0}, 0.4);
    const double rounding = p.integrator == Integrator::modal ? 0.0 : 1e-14;
    EXPECT_NEAR(b->tip_displacement(), u, rounding * u);
    EXPECT_NEAR(b->kinetic_energy(), 0.0, rounding * rounding * b->strain_energy());
  }
}

// Nothing is strained yet, so the clamp bears no moment: all of that of the loads goes into ∫ρA x ü.
TEST(BeamStatics, TheClampOfAStraightBeamBearsNoMoment) {
  for (Parameters p : variants()) {
    if (p.mass_matrix == MassMatrix::averaged) continue;  // another inertia than ∫ρA x ü
    p.n_modes = 0;
    p.initial_deflection_slope = p.initial_velocity_slope = 0.0;
    const auto b = make_beam(p);
    Noise noise;
    b->set_forces(0.7, every_load(1.0, noise));
    EXPECT_NEAR(b->response().forces.moment[0], 0.0, 1e-12);
    EXPECT_GT(std::abs(b->tip_acceleration()), 0.1);
  }
}

TEST(BeamStatics, UniformLoadConvergesToTheExactDeflectionInSecondOrder) {
  // Exact u(L) = f_b (L⁴/8EI + L²/2KAG).
  double previous = 0.0;
  for (const int n : {10, 20, 40}) {
    Parameters p = general_beam(n);
    p.alpha_b = 1.0;
    p.n_modes = 2;
    const double L = p.length, exact = L * L * L * L / (8.0 * bending(p)) + L * L / (2.0 * shearing(p));
    const auto b = make_beam(p);
    b->step(1000.0, {0.0, 0.0, 0.0}, 1.0);
    const double error = std::fabs(b->tip_displacement() / exact - 1.0);
    if (previous > 0.0) {
      EXPECT_NEAR(previous / error, 4.0, 0.1) << n;
    }
    previous = error;
  }
}

TEST(BeamStatics, LoadsAreConsistent) {
  // Reciprocity: the tip deflection under a load equals the work of that load on the shape of the unit tip force.
  for (const Integrator integrator : {Integrator::modal, Integrator::midpoint}) {
    Parameters p = with_integrator(general_beam(9), integrator);
    p.alpha_b = 1.0;
    p.n_modes = 3;
    Timoshenko mesh(p);
    const Eigen::VectorXd shape = mesh.flexibility_times(mesh.load(Loads::tip));
    const auto at_rest = [&](const Loads& loads) {
      auto b = make_beam(p);
      b->set_forces(0.0, loads);
      if (integrator == Integrator::midpoint) b->put_at_rest();
      b->step(1000.0, {0.0, 0.0, 0.0}, loads);
      return b;
    };
    for (std::size_t i = 0; i < Loads::count; ++i) {
      Loads loads;
      loads.set(i, {2.0, 0.0, 0.0});
      const double work = 2.0 * mesh.load(i).dot(shape);
      EXPECT_NEAR(at_rest(loads)->tip_displacement(), work, 1e-12 * std::abs(work)) << Loads::names[i];
    }
    Loads loads(2.0);
    loads.set(Loads::hat, {-6.0, 0.0, 0.0});
    const auto b = at_rest(loads);
    // At rest the potential of the load is −2 times the strain energy (Clapeyron).
    EXPECT_NEAR(b->load_potential(), -2.0 * b->strain_energy(), 1e-11 * b->strain_energy());
    // What the clamp bears is the loads: the hat's −6 h/2 acts h/3 before the tip.
    const double L = p.length, h = L / p.n_elements;
    EXPECT_NEAR(b->response().forces.shear[0], 2.0 * L - 3.0 * h, 1e-9);
    EXPECT_NEAR(b->response().forces.moment[0], L * L - 3.0 * h * (L - h / 3.0), 1e-9);
  }
}

}  // namespace
}  // namespace beam
