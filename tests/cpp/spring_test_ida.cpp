// The layers below the spring: IDA wrapper and its events, Jacobians, Taylor polynomial.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "flight.hpp"
#include "ida_solver.hpp"
#include "parameters.hpp"
#include "spring_support.hpp"

using namespace spring;
using spring_test::epsilon;

namespace {

/// Y₀' = Y₁, Y₁' = −ω² Y₀: cosine; its distance to a level.
class Cosine final : public ImplicitSystem {
 public:
  Cosine(double omega, double level) : omega_(omega), level_(level) {}
  bool residual(double, const double* Y, const double* Yp, double* F) const noexcept override {
    F[0] = Yp[0] - Y[1];
    F[1] = Yp[1] + omega_ * omega_ * Y[0];
    return true;
  }
  void jacobian(double, double c, const double*, const double*, double* J) const noexcept override {
    J[0] = J[3] = c;
    J[2] = -1.0;
    J[1] = omega_ * omega_;
  }
  Distance distance(int which, double, const double* Y) const noexcept override {
    return which == 0 ? Distance{Y[0] - level_, Y[1]} : Distance{1.0, 1.0};
  }

 private:
  double omega_, level_;
};

void start_cosine(IdaSolver& solver, const Cosine& system, double omega) {
  solver.initial_value()[0] = 1.0;
  solver.initial_value()[1] = solver.initial_derivative()[0] = 0.0;
  solver.initial_derivative()[1] = -omega * omega;
  solver.absolute_tolerance()[0] = 1e-13;
  solver.absolute_tolerance()[1] = 1e-13 * omega;
  solver.start(system, 1e-13, 1e-7, 100000);
}

/// ∂F/∂Y + c ∂F/∂Y' by central differences.
template <std::size_t n>
void expect_jacobian(const ImplicitSystem& system, double s, double c, std::array<double, n> Y,
                     std::array<double, n> step, double tolerance) {
  std::array<double, n> Yp{};
  Yp.fill(0.3);
  std::array<double, n * n> J{};
  system.jacobian(s, c, Y.data(), Yp.data(), J.data());
  for (std::size_t j = 0; j < n; ++j) {
    const auto residual = [&](double h) {
      auto Z = Y, Zp = Yp;
      Z[j] += h;
      Zp[j] += c * h;
      std::array<double, n> F{};
      EXPECT_TRUE(system.residual(s, Z.data(), Zp.data(), F.data()));
      return F;
    };
    const auto up = residual(step[j]), down = residual(-step[j]);
    for (std::size_t i = 0; i < n; ++i) {
      const double difference = (up[i] - down[i]) / (2 * step[j]);
      EXPECT_NEAR(J[j * n + i], difference, tolerance * (1.0 + std::abs(difference))) << "row " << i << " column " << j;
    }
  }
}

Parameters nonlinear() {
  Parameters p;
  p.mass = 1.3;
  p.damping = 0.7;
  p.linear_stiffness = 20.0;
  p.cubic_stiffness = 9.0;
  p.contact_law = ContactLaw::normal_compliance;
  p.compliance_stiffness = 300.0;
  p.compliance_exponent = 1.5;
  p.stop_enabled = true;
  p.stop_position = -0.2;
  return p;
}

}  // namespace

// cos ωs falls through the level at s = arccos(level)/ω. The search ends at an ulp, and then the solution's error,
// asked to be 1e-13 per internal step, is what is left.
TEST(IdaSolver, EventWhereADistanceFalls) {
  const Cosine system(3.0, 0.4);
  IdaSolver solver(2);
  start_cosine(solver, system, 3.0);
  ASSERT_EQ(solver.advance(), 0);
  EXPECT_NEAR(solver.s(), std::acos(0.4) / 3.0, 1e-11);
  EXPECT_NEAR(solver.value()[0], 0.4, 4 * epsilon);
}

// The lowest point of cos ωs is 1e-9 below the level for 1.4e-5 of s; internal steps are a hundred times longer.
TEST(IdaSolver, DistanceThatDipsWithinOneInternalStep) {
  const Cosine system(6.0, -1.0 + 1e-9);
  IdaSolver solver(2);
  start_cosine(solver, system, 6.0);
  ASSERT_EQ(solver.advance(), 0);
  EXPECT_NEAR(solver.s(), (3.14159265358979323846 - std::sqrt(2e-9)) / 6.0, 1e-7);
  EXPECT_LT(solver.s(), 3.14159265358979323846 / 6.0);
}

// Rising at the start: the same dip of sin ωs, where the rate of the last step's start counts, not that at s = 0.
TEST(IdaSolver, DistanceThatRisesFirstAndDipsLater) {
  const Cosine system(6.0, -1.0 + 1e-8);
  IdaSolver solver(2);
  start_cosine(solver, system, 6.0);
  solver.initial_value()[0] = solver.initial_derivative()[1] = 0.0;
  solver.initial_value()[1] = solver.initial_derivative()[0] = 6.0;
  solver.start(system, 1e-13, 1e-7, 100000);
  ASSERT_EQ(solver.advance(), 0);
  EXPECT_NEAR(solver.s(), (1.5 * 3.14159265358979323846 - std::sqrt(2e-8)) / 6.0, 2e-7);
}

// Above the level at its lowest: no fall, on to the end.
TEST(IdaSolver, MinimumAboveTheLevelIsNoFall) {
  const Cosine system(6.0, -1.0 - 1e-9);
  IdaSolver solver(2);
  start_cosine(solver, system, 6.0);
  ASSERT_EQ(solver.advance(), -1);
  EXPECT_EQ(solver.s(), 1.0);
  EXPECT_NEAR(solver.value()[0], std::cos(6.0), 2e-10);  // 1e-13 in each of some 1000 steps
}

// A distance and its rate that are 0 at the start: it falls there.
TEST(IdaSolver, ExactZerosDoNotSwitchEventsOff) {
  const Cosine at_start(3.0, 1.0);  // distance and rate are 0 at s = 0
  IdaSolver solver(2);
  start_cosine(solver, at_start, 3.0);
  ASSERT_EQ(solver.advance(), 0);
  EXPECT_LT(solver.s(), 1e-6);
  const Cosine system(3.0, 0.5);
  solver.start(system, 1e-13, 1e-7, 100000);
  ASSERT_EQ(solver.advance(), 0);
  EXPECT_NEAR(solver.s(), 3.14159265358979323846 / 9.0, 1e-11);
}

// The steps allowed are those since start().
TEST(IdaSolver, StepsAreCountedFromTheStart) {
  const Cosine system(60.0, -2.0);  // the level is never reached
  IdaSolver solver(2);
  start_cosine(solver, system, 60.0);
  EXPECT_EQ(solver.advance(), -1);
  const long needed = solver.steps();
  solver.start(system, 1e-13, 1e-7, needed);
  EXPECT_NO_THROW(solver.advance());
  solver.start(system, 1e-13, 1e-7, needed - 1);
  EXPECT_THROW(solver.advance(), IdaError);
}

TEST(IdaSolver, FailureCarriesIdasFlag) {
  class Nowhere final : public ImplicitSystem {
    bool residual(double, const double*, const double*, double*) const noexcept override { return false; }
    void jacobian(double, double, const double*, const double*, double*) const noexcept override {}
    Distance distance(int, double, const double*) const noexcept override { return {1.0, 1.0}; }
  };
  const Nowhere system;
  IdaSolver solver(1);
  solver.start(system, 1e-6, 1e-3, 100000);
  try {
    solver.advance();
    FAIL() << "no error";
  } catch (const IdaError& error) {
    EXPECT_NE(std::string(error.what()).find("IDA_"), std::string::npos) << error.what();
  }
}

TEST(Flight, JacobianMatchesDifferences) {
  Parameters p = nonlinear();
  Loads loads;
  loads.force = {1.0, -2.0, 3.0};
  const double H = 0.02, y = 0.15, z = 0.5;
  // Undamped, damped and, the tip leaving faster than 1/χ, without a force.
  for (const auto& [damping, speed] : std::array<std::pair<double, double>, 3>{{{0.0, 0.4}, {0.8, 0.4}, {0.8, 3.0}}}) {
    p.compliance_damping = damping;
    const Motion motion(p);
    Flight flight(motion, p);
    loads.tip = {0.05, speed, -1.0};
    // Touching, δ = 0.1; unresolved steps have another reference polynomial.
    for (const double size : {H, 40 * H}) {
      const Start start{y, z, loads, size, y + 0.2, y - 0.05, false, 100000};
      flight.run(start);
      const double d = 1e-5;
      expect_jacobian<5>(flight, 0.3, 17.0, {0.01, 0.003, 0.1, 0.2, 0.3}, {d, d * size, d, d, d}, 1e-7);
    }
  }
}

Series expanded(const Motion& motion, double y, double z, const Loads& loads, double H, bool touching, double depth) {
  Expansion e(y, z, depth, loads, H);
  while (e.highest <= max_order) motion.extend(e, touching, loads, H);
  return e.y;
}

// ÿ − R̈ without cancellation is the same as the difference of both, to the rounding of that difference.
TEST(Motion, ExcessAccelerationIsTheDifference) {
  const Parameters p = nonlinear();
  const Motion motion(p);
  constexpr double H = 0.2;
  Loads loads;
  loads.force = scaled({1.0, -2.0, 3.0}, H);
  const Series y = expanded(motion, 0.15, 0.5, loads, H, false, 0.0);
  for (const int order : {0, 2, 4, max_order}) {
    const Taylor R(y, order);
    const auto remainder = motion.remainder(R, loads, H);
    for (const double s : {0.0, 0.05, 1.0}) {
      const double q = 0.02, w = -0.3;
      double second = 0.0;
      for (int k = order; k >= 2; --k) second = second * s + k * (k - 1) * y[static_cast<std::size_t>(k)];
      const double acceleration = motion.acceleration(R(s) + q, R.rate(s) / H + w, value(loads.force, s), 0.0);
      EXPECT_NEAR(motion.excess_acceleration(R(s), q, w, remainder(s), 0.0), acceleration - second / (H * H),
                  1000 * epsilon)
          << order << " " << s;
    }
  }
}

// The coefficients that a start is expanded in, against differences of those one lower at later starts; for contact
// forces that are a power of a depth > 0, and of one that begins at 0.
TEST(Motion, ExpansionIsThatOfTheMotion) {
  Parameters p = nonlinear();
  Loads loads;
  loads.force = {1.0, -2.0, 3.0};
  const double z = 0.5, h = 1e-3;
  struct Kind {
    bool touching;
    double damping, exponent, depth, speed = 0.4;  // of the tip
  };
  for (const auto& [touching, damping, exponent, depth, speed] :
       {Kind{false, 0.0, 1.5, 0.1}, Kind{true, 0.0, 1.5, 0.1}, Kind{true, 0.8, 1.5, 0.1}, Kind{true, 0.8, 3.0, 0.1},
        Kind{true, 0.0, 1.0, 0.0}, Kind{true, 0.8, 2.0, 0.0}, Kind{true, 0.8, 1.5, 0.1, 3.0}}) {
    loads.tip = {0.05, speed, -1.0};
    p.compliance_damping = damping;
    p.compliance_exponent = exponent;
    const Motion motion(p);
    const double y = loads.tip[0] + depth;
    const Series c = expanded(motion, y, z, loads, 1.0, touching, depth);
    const double force = touching ? motion.compliance().force(depth, z - speed) : 0.0;
    EXPECT_NEAR(2 * c[2], motion.acceleration(y, z, loads.force[0], force), 1e-13) << exponent;
    const Taylor R(c, max_order);
    const auto at = [&](double t) {
      const double deep = depth + R.rise(t) - speed * t + t * t / 2;
      return expanded(motion, R(t), R.rate(t), loads.from_time(t), 1.0, touching, deep);
    };
    const std::array<Series, 4> later{at(h), at(2 * h), at(3 * h), at(4 * h)};
    for (std::size_t k = 2; k < max_order; ++k) {
      const double rise = -25 * c[k] + 48 * later[0][k] - 36 * later[1][k] + 16 * later[2][k] - 3 * later[3][k];
      const double difference = rise / (12 * h) / static_cast<double>(k + 1);
      EXPECT_NEAR(c[k + 1], difference, 2e-3 * std::abs(difference) + 1e-9) << exponent << ", coefficient " << k + 1;
    }
  }
}

TEST(Taylor, IntegralsAreExact) {
  const Taylor R({1.0, -2.0, 3.0, 2.0, -2.0}, 4);
  EXPECT_DOUBLE_EQ(R(0.5), 1 - 1 + 0.75 + 0.25 - 0.125);
  EXPECT_DOUBLE_EQ(R.integral(1.0), 1 - 1 + 1 + 0.5 - 0.4);
  EXPECT_DOUBLE_EQ(R.integral_2(1.0), 0.5 - 1.0 / 3 + 0.25 + 0.1 - 1.0 / 15);
  // ∫ (−2 + 6s + 6s² − 8s³)²
  EXPECT_DOUBLE_EQ(R.squared_rate_integral(1.0), 4.0 - 12 + 4 + 26 - 12 - 16 + 64.0 / 7);
}
