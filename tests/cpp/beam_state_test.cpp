// Impulses, save and restore, and what is refused.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "beam.hpp"
#include "beam_testing.hpp"

namespace beam {
namespace {

using testing::general_beam;
using testing::mechanical_energy;
using testing::outputs;
using testing::unit_beam;
using testing::variants;
using testing::with_integrator;

TEST(BeamState, AnImpulseMovesTheTipMassOnly) {
  for (const Parameters& p : variants()) {
    const auto b = make_beam(p);
    b->step(0.01, {0.3, 0.0, 0.0}, 0.1);
    const double v = b->tip_velocity(), u = b->tip_displacement(), before = mechanical_energy(*b),
                 strain = b->strain_energy();
    const double J = 0.37;
    b->apply_tip_impulse(J);
    EXPECT_NEAR(b->tip_velocity() - v, J / b->tip_mass(), 1e-12 * J / b->tip_mass());                // momentum
    EXPECT_NEAR(mechanical_energy(*b) - before, 0.5 * J * (v + b->tip_velocity()), 1e-12 * before);  // its work
    EXPECT_EQ(b->tip_displacement(), u);
    EXPECT_EQ(b->strain_energy(), strain);
    b->apply_tip_impulse(-J);
    EXPECT_NEAR(b->tip_velocity(), v, 1e-12);
  }
}

TEST(BeamState, TheTipMassOfTheMeshIsThatOfTheLastElements) {
  // eᵀM⁻¹e of the u-block h/6·tridiag(1, 4, 1) with 2 at the end: for many elements 2√3/(ρA h), since the pivots tend
  // to (2 + √3)h/6 from the clamp, and 2 − 1/(2 + √3) = √3 … the last is √3 h/6.
  for (const Integrator integrator : {Integrator::modal, Integrator::midpoint}) {
    const Parameters p = with_integrator(general_beam(40), integrator);
    const double h = p.length / p.n_elements;
    EXPECT_NEAR(make_beam(p)->tip_mass(), p.density * p.area * h * std::sqrt(3.0) / 6.0, 1e-11);
  }
}

TEST(BeamState, AStepRepeatedFromTheSameStateIsBitIdentical) {
  for (const Parameters& p : variants()) {
    const auto b = make_beam(p);
    const auto some_steps = [&b] {
      b->step(0.01, {0.3, 2.0, -50.0}, 0.1);
      b->apply_tip_impulse(0.2);
      b->apply_tip_impulse(-0.1);
      b->step(0.004, {-0.6, 0.0, 0.0}, 0.1);
      b->set_forces(0.0, 0.4);
      b->step(0.004, {-0.6, 0.0, 0.0}, 0.3);
      return outputs(*b);
    };
    some_steps();
    for (const bool after_impulse : {false, true}) {
      if (after_impulse) b->apply_tip_impulse(0.05);
      const Beam::State state = b->state();
      const std::vector<double> saved = outputs(*b);
      const std::vector<double> first = some_steps();

      b->restore(state);
      EXPECT_EQ(outputs(*b), saved);  // outputs of the last step included
      EXPECT_EQ(some_steps(), first);

      // More step sizes than the cache holds, as event location does, must change nothing.
      b->restore(state);
      for (int i = 1; i < 9; ++i) b->step(0.01 / i, {1.0, 1.0, 1.0}, 0.0);
      b->restore(state);
      EXPECT_EQ(outputs(*b), saved);
      EXPECT_EQ(some_steps(), first);

      // Nor does it matter which object continues.
      const auto other = make_beam(p);
      other->restore(state);
      EXPECT_EQ(outputs(*other), saved);
      other->step(0.007, {1.0, 0.0, 0.0}, 0.0);
      b->restore(state);
      b->step(0.007, {1.0, 0.0, 0.0}, 0.0);
      EXPECT_EQ(outputs(*other), outputs(*b));

      // Nor that the step was tried with another force or load before, from another velocity or from another place.
      Beam::State moved = state;
      moved.q[0] += 0.01;
      const Beam::State& elsewhere = moved;
      for (const auto& [load, impulse, from] : {std::tuple(0.0, 0.0, &state), std::tuple(0.6, 0.0, &state),
                                                std::tuple(0.6, 0.1, &state), std::tuple(0.6, 0.1, &elsewhere)}) {
        const auto fresh = make_beam(p);
        for (Beam* one : {b.get(), fresh.get()}) {
          one->restore(*from);
          one->apply_tip_impulse(impulse);
          one->step(0.007, {-3.0, 2.0, 0.0}, load);
        }
        EXPECT_EQ(outputs(*fresh), outputs(*b));
      }
    }
  }
}

TEST(BeamState, AResultThatIsNotFiniteLeavesTheStateUnchanged) {
  for (const Parameters& p : variants()) {
    const auto b = make_beam(p);
    b->step(0.01, {0.3, 0.0, 0.0}, 0.1);
    const std::vector<double> before = outputs(*b);
    EXPECT_THROW(b->step(1e9, {1e308, 1e308, 1e308}, -3.0), std::overflow_error);
    EXPECT_EQ(outputs(*b), before);
    EXPECT_THROW(b->apply_tip_impulse(1.7e308), std::overflow_error);
    EXPECT_EQ(outputs(*b), before);
    // The tip's motion is finite, the energies are not.
    EXPECT_THROW(b->step(1e-3, {1e200, 0.0, 0.0}, 0.1), std::overflow_error);
    EXPECT_EQ(outputs(*b), before);
    // What is seen of the force at once is too large, then what the integrals grow with.
    EXPECT_THROW(b->step(1e-200, {1e200, 0.0, 0.0}, 0.1), std::overflow_error);
    EXPECT_THROW(b->step(1e11, {0.0, 0.0, 0.0}, 0.0), std::domain_error);
    EXPECT_EQ(outputs(*b), before);
    try {
      b->step(0.25, {1e200, 2.0, 3.0}, Polynomial{4.0, 5.0, 6.0});
      ADD_FAILURE() << "the step was made";
    } catch (const std::overflow_error& error) {
      const std::string said =
          "step of 0.25 s under the tip force 1e+200 N, 2 N/s, 3 N/s2, distributed_load = 4 and its "
          "derivatives 5, 6;";
      EXPECT_NE(std::string(error.what()).find(said), std::string::npos) << error.what();
    }
    const auto same = make_beam(p);
    same->step(0.01, {0.3, 0.0, 0.0}, 0.1);
    same->step(0.01, {0.2, 0.0, 0.0}, 0.1);
    b->step(0.01, {0.2, 0.0, 0.0}, 0.1);
    EXPECT_EQ(outputs(*b), outputs(*same));
  }
}

// ε ω H is the error of a phase: 1e12 rad keep 4 digits of it. An overdamped mode has no phase.
TEST(BeamState, AStepWhosePhasesAreRoundingIsRefused) {
  Parameters p = unit_beam(4, 1e28);
  p.initial_velocity_slope = 1.0;
  const double fastest = testing::frequencies(p).back();
  const auto b = make_beam(p);
  EXPECT_THROW(b->step(1.01e12 / fastest, {}, 0.0), std::domain_error);
  EXPECT_NO_THROW(b->step(0.99e12 / fastest, {}, 0.0));
  p.alpha_b = 1.0;
  EXPECT_NO_THROW(make_beam(p)->step(1.01e12 / fastest, {}, 0.0));
}

// The message names the parameter, its value and what is allowed.
TEST(BeamState, ParametersThatDoNotGoTogetherAreRefused) {
  struct Refused {
    std::function<void(Parameters&)> change;
    std::vector<std::string> named;
  };
  const std::vector<Refused> all = {
      {[](Parameters& p) { p.n_elements = 2000000; }, {"n_elements"}},
      {[](Parameters& p) { p.element_degree = 8, p.n_elements = 27778; }, {"n_elements", "27777", "element_degree"}},
      {[](Parameters& p) { p.element_degree = 2, p.n_modes = 201; }, {"n_modes", "200", "50 elements of degree 2"}},
      {[](Parameters& p) { p.element_degree = 11; }, {"n_modes", "= 0 ", "550", "1000 unknowns"}},
      {[](Parameters& p) { p.n_modes = 101; }, {"n_modes", "= 101 ", "100"}},
      {[](Parameters& p) { p.n_elements = 501; }, {"n_modes", "= 0 ", "midpoint", "fewer n_modes"}},
      {[](Parameters& p) { p.n_elements = 501, p.n_modes = 502; }, {"n_modes", "= 502 ", "501"}},
      {[](Parameters& p) { p.element_degree = 8, p.n_elements = 27777; },
       {"n_modes", "between 1 and 56 with 27777 elements of degree 8"}},
      {[](Parameters& p) { p.length = 1e-320, p.n_elements = 5; }, {"length / n_elements"}},
      {[](Parameters& p) { p.density = 1e-200, p.area = 1e-200; }, {"density * area"}},
      {[](Parameters& p) { p.second_moment_of_area = 1e300, p.area = 1e-300; }, {"second_moment_of_area / area"}},
      {[](Parameters& p) { p.second_moment_of_area = 1e-290, p.shear_modulus = 1e30; }, {"bending stiffness"}},
      {[](Parameters& p) { p.young_modulus = 1e-310; }, {"young_modulus * area"}},
      {[](Parameters& p) { p.shear_modulus = 1e-310; }, {"shear_modulus * shear_coefficient * area"}},
  };
  for (const Refused& refused : all) {
    Parameters p = unit_beam(50);
    refused.change(p);
    try {
      const auto b = make_beam(p);
      ADD_FAILURE() << "accepted: " << refused.named[0];
    } catch (const std::invalid_argument& error) {
      for (const std::string& part : refused.named) {
        EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
      }
    }
  }
  Parameters p = unit_beam(50);
  p.second_moment_of_area = 1e-290;  // no digit is left of a mode
  p.shear_modulus = 1e20;
  try {
    const auto b = make_beam(p);
    ADD_FAILURE() << "accepted";
  } catch (const std::runtime_error& error) {
    for (const char* part : {"mode 1 of 100", "did not converge", "allowed is 1e-06; keep fewer n_modes"}) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  }
  p = unit_beam(500);
  p.integrator = Integrator::midpoint;
  p.n_elements = 5000;  // no eigenproblem: any number of elements
  EXPECT_NO_THROW(make_beam(p));
}

}  // namespace
}  // namespace beam
