// The layers below the spring: IDA wrapper, Jacobians, Taylor series, falls of polynomials.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <initializer_list>
#include <string>
#include <vector>

#include "events.hpp"
#include "flight.hpp"
#include "ida_solver.hpp"
#include "parameters.hpp"
#include "spring_support.hpp"

using namespace spring;
using spring_test::epsilon;

namespace {

/// Y₀' = Y₁, Y₁' = −ω² Y₀: cosine.
class Cosine final : public ImplicitSystem {
 public:
  explicit Cosine(double omega) : omega_(omega) {}
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

 private:
  double omega_;
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

// IDA's error is asked to be 1e-13 in each of some 1000 internal steps, and over the last one it is a polynomial, of
// both unknowns.
TEST(IdaSolver, StepsToTheEnd) {
  const Cosine system(6.0);
  IdaSolver solver(2);
  start_cosine(solver, system, 6.0);
  while (solver.s() < 1.0) solver.step();
  EXPECT_EQ(solver.s(), 1.0);
  EXPECT_NEAR(solver.value()[0], std::cos(6.0), 2e-10);
  const auto [cosine, degree] = solver.over_last_step(0);
  const auto [slope, slope_degree] = solver.over_last_step(1);
  for (const double part : {0.0, 0.3, 1.0}) {
    const double s = solver.last_start() + part * (1.0 - solver.last_start());
    EXPECT_NEAR(sum_of_powers(cosine, part, 0, degree), std::cos(6.0 * s), 2e-10);
    EXPECT_NEAR(sum_of_powers(slope, part, 0, slope_degree), -6.0 * std::sin(6.0 * s), 2e-9);
  }
  solver.interpolate(solver.last_start());
  EXPECT_DOUBLE_EQ(solver.value()[0], cosine[0]);
}

// The steps allowed are those since start().
TEST(IdaSolver, StepsAreCountedFromTheStart) {
  const Cosine system(60.0);
  IdaSolver solver(2);
  start_cosine(solver, system, 60.0);
  const auto go_on = [&] {
    while (solver.s() < 1.0) solver.step();
  };
  go_on();
  const long needed = solver.steps();
  solver.start(system, 1e-13, 1e-7, needed);
  EXPECT_NO_THROW(go_on());
  solver.start(system, 1e-13, 1e-7, needed - 1);
  EXPECT_THROW(go_on(), SolverError);
}

TEST(IdaSolver, FailureCarriesIdasFlag) {
  class Nowhere final : public ImplicitSystem {
    bool residual(double, const double*, const double*, double*) const noexcept override { return false; }
    void jacobian(double, double, const double*, const double*, double*) const noexcept override {}
  };
  const Nowhere system;
  IdaSolver solver(1);
  solver.start(system, 1e-6, 1e-3, 100000);
  try {
    solver.step();
    FAIL() << "no error";
  } catch (const SolverError& error) {
    EXPECT_NE(std::string(error.what()).find("IDA_"), std::string::npos) << error.what();
  }
}

TEST(IntegratedFlight, JacobianMatchesDifferences) {
  Parameters p = nonlinear();
  Loads loads;
  loads.force = {1.0, -2.0, 3.0};
  const double H = 0.02, y = 0.15, z = 0.5;
  // Undamped, damped and, the tip leaving faster than 1/χ, without a force.
  for (const auto& [damping, speed] : std::array<std::pair<double, double>, 3>{{{0.0, 0.4}, {0.8, 0.4}, {0.8, 3.0}}}) {
    p.compliance_damping = damping;
    const EquationOfMotion motion(p);
    IntegratedFlight flight(motion, p);
    loads.tip = {0.05, speed, -1.0};
    for (const double size : {H, 40 * H}) {
      const Start start{y, z, loads, size, y + 0.2, y - 0.05, false, 100000};
      FlightEnd end{};
      flight.run(start, true, end);
      const double d = 1e-5;
      expect_jacobian<5>(flight, 0.3, 17.0, {0.01, 0.003, 0.1, 0.2, 0.3}, {d, d * size, d, d, d}, 1e-7);
    }
  }
}

Series expanded(const EquationOfMotion& equation, double y, double z, const Loads& loads, double H, bool touching,
                double depth) {
  Expansion e(y, z, depth, loads, H, touching);
  while (e.highest <= max_order) equation.extend(e);
  return e.x;
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
    const EquationOfMotion motion(p);
    const double y = loads.tip[0] + depth;
    const Series c = expanded(motion, y, z, loads, 1.0, touching, depth);
    const double force = touching ? motion.compliance().force(depth, z - speed) : 0.0;
    EXPECT_NEAR(2 * c[2], motion.acceleration(y, z, loads.force[0], force), 1e-13) << exponent;
    Series rate{};
    for (std::size_t k = 1; k <= max_order; ++k) rate[k - 1] = static_cast<double>(k) * c[k];
    const auto at = [&](double t) {
      const double rise = sum_of_powers(c, t, 1, max_order), deep = depth + rise - speed * t + t * t / 2;
      return expanded(motion, y + rise, sum_of_powers(rate, t, 0, max_order - 1), loads.from_time(t), 1.0, touching,
                      deep);
    };
    const std::array<Series, 4> later{at(h), at(2 * h), at(3 * h), at(4 * h)};
    for (std::size_t k = 2; k < max_order; ++k) {
      const double rise = -25 * c[k] + 48 * later[0][k] - 36 * later[1][k] + 16 * later[2][k] - 3 * later[3][k];
      const double difference = rise / (12 * h) / static_cast<double>(k + 1);
      EXPECT_NEAR(c[k + 1], difference, 2e-3 * std::abs(difference) + 1e-9) << exponent << ", coefficient " << k + 1;
    }
  }
}

namespace {

/// (s − r₁)(s − r₂)… × factor
Series with_roots(std::initializer_list<double> roots, double factor = 1.0) {
  Series c{factor};
  for (const double root : roots)
    for (std::size_t k = c.size(); k-- > 0;) c[k] = (k > 0 ? c[k - 1] : 0.0) - root * c[k];
  return c;
}

}  // namespace

// Falls of polynomials with known roots: the first from + to −, whatever turns lie before it.
TEST(Falls, AreTheFirstChangeToNegative) {
  const auto fall = [](std::initializer_list<double> roots, double factor) {
    return first_fall(with_roots(roots, factor), static_cast<int>(roots.size())).value_or(-1.0);
  };
  EXPECT_NEAR(fall({0.3}, -1.0), 0.3, 1e-15);
  EXPECT_EQ(fall({0.3}, 1.0), 0.0);  // below 0 at the start
  EXPECT_EQ(fall({1.3}, -1.0), -1.0);
  EXPECT_NEAR(fall({0.3, 0.31}, 1.0), 0.3, 1e-14);
  Series touching = with_roots({0.2, 0.2, 0.6, 0.9});
  touching[0] += 1e-12;  // at its least near 0.2
  EXPECT_NEAR(first_fall(touching, 4).value_or(-1.0), 0.6, 1e-10);
  EXPECT_NEAR(fall({0.1, 0.11, 0.5, 0.51, 0.9, 0.91}, 1.0), 0.1, 1e-14);
  EXPECT_EQ(fall({0.0, 2.0}, -1.0), -1.0);              // starts at 0 and rises
  EXPECT_EQ(fall({0.0, 2.0}, 1.0), 0.0);                // starts at 0 and falls
  EXPECT_NEAR(fall({0.0, 0.4, 0.7}, 1.0), 0.4, 1e-15);  // starts at 0, rises, falls
  EXPECT_NEAR(fall({0.0, 0.0, 0.4, 0.7}, 1.0), 0.4, 1e-15);
  EXPECT_NEAR(fall({0.5, 0.5, 0.5}, -1.0), 0.5, 1e-5);
  EXPECT_EQ(first_fall(Series{}, 3).value_or(-1.0), -1.0);  // rests at 0
}
