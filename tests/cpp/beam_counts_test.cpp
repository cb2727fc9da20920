// What a beam lacks costs nothing: counted, by a linker wrap around the function that the work goes through.

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "beam.hpp"
#include "beam_testing.hpp"
#include "modal_oscillator.hpp"

namespace {
int dissipations = 0;
}

// tests/cpp/CMakeLists.txt links beam_tests with --wrap for beam::oscillator_dissipation(double, double, double).
std::array<double, 10> real_dissipation(double omega, double c,
                                        double t) asm("__real__ZN4beam22oscillator_dissipationEddd");
std::array<double, 10> wrapped_dissipation(double omega, double c,
                                           double t) asm("__wrap__ZN4beam22oscillator_dissipationEddd");
std::array<double, 10> wrapped_dissipation(double omega, double c, double t) {
  ++dissipations;
  return real_dissipation(omega, c, t);
}

namespace beam {
namespace {

using testing::general_beam;

int counted(double alpha_b, void (*run)(Beam&)) {
  Parameters p = general_beam(7);
  p.alpha_b = alpha_b;
  p.initial_velocity_slope = 1.0;
  const auto b = make_beam(p);
  dissipations = 0;
  run(*b);
  return dissipations;
}

void ten_steps(Beam& b) {
  for (int i = 0; i < 10; ++i) b.step(0.01, {1.0, 2.0, 3.0}, 0.0);
}

TEST(BeamCounts, WithoutDampingNoDissipationIsComputed) {
  EXPECT_EQ(counted(0.0, ten_steps), 0);
  EXPECT_EQ(counted(0.0, [](Beam& b) { EXPECT_EQ(b.dissipated_energy(), 0.0); }), 0);
  // With it, once per mode and step size.
  EXPECT_EQ(counted(1e-3, ten_steps), 14);
}

TEST(BeamCounts, TheSizeOfMostStepsIsKeptWhileOthersComeAndGo) {
  const auto event_location = [](Beam& b) {
    for (int i = 1; i < 9; ++i) {
      b.step(0.01, {}, 0.0);
      b.step(0.01 / (i + 1), {}, 0.0);
    }
    b.dissipated_energy();
  };
  EXPECT_EQ(counted(1e-3, event_location), 9 * 14);
}

TEST(BeamCounts, AStepThatIsTakenBackNeverPaysForItsDissipation) {
  const auto tried = [](Beam& b) {
    const Beam::State state = b.state();
    for (int i = 1; i < 9; ++i) {
      b.step(0.01 / i, {1.0, 0.0, 0.0}, 0.0);
      b.restore(state);
    }
  };
  EXPECT_EQ(counted(1e-3, tried), 0);
}

}  // namespace
}  // namespace beam
