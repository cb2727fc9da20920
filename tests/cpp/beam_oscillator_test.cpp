// The exact step of one mode against quadruple precision.
//
// Reference: with p = v/x the chain (p, y, ∫y, ∫∫y, …) of the scaled equation y'' + d y' + x² y = 0 is linear,
//   p' = −d p − x y,  y' = x p,  I₁' = y,  I₂' = I₁, …;
// its propagator over unit time is exp A = (exp(A/2^s))^(2^s), here by Taylor series and squaring with 113 bits.
// x = ωt and d = ct are formed there of the doubles ω, c, t taken as exact. Its own error is about 2^s 1e-34.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "beam_testing.hpp"
#include "modal_oscillator.hpp"

namespace {

__extension__ typedef __float128 Quad;

constexpr std::size_t n = 7;
using Matrix = std::array<std::array<Quad, n>, n>;

Matrix product(const Matrix& a, const Matrix& b) {
  Matrix c{};
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < n; ++k) {
      if (a[i][k] == 0) continue;
      for (std::size_t j = 0; j < n; ++j) c[i][j] += a[i][k] * b[k][j];
    }
  }
  return c;
}

Matrix identity() {
  Matrix one{};
  for (std::size_t i = 0; i < n; ++i) one[i][i] = 1;
  return one;
}

Matrix exponential(Matrix a) {
  Quad norm = 0;
  for (const auto& row : a) {
    for (const Quad& value : row) norm += value < 0 ? -value : value;
  }
  int squarings = 0;
  for (; norm > Quad(1) / 16; norm /= 2) ++squarings;
  for (auto& row : a) {
    for (Quad& value : row) {
      for (int s = 0; s < squarings; ++s) value /= 2;
    }
  }
  Matrix sum = identity(), term = identity();
  for (int k = 1; k <= 24; ++k) {
    term = product(term, a);
    for (auto& row : term) {
      for (Quad& value : row) value /= k;
    }
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) sum[i][j] += term[i][j];
    }
  }
  for (int s = 0; s < squarings; ++s) sum = product(sum, sum);
  return sum;
}

struct Reference {
  Quad decay;                 // ġ
  std::array<Quad, 6> gamma;  // G_k/t^{k+1}
};

Reference reference(double omega, double c, double t) {
  const Quad x = Quad(omega) * t, d = Quad(c) * t;
  Matrix a{};
  a[0][0] = -d;
  a[0][1] = -x;
  a[1][0] = x;
  for (std::size_t i = 2; i < n; ++i) a[i][i - 1] = 1;
  const Matrix e = exponential(a);  // column 0 starts from p = 1, that is ẏ = x
  Reference r;
  r.decay = e[0][0];
  for (std::size_t k = 0; k < 6; ++k) r.gamma[k] = e[k + 1][0] / x;
  return r;
}

// Amplitude of what oscillates or decays in γ_k: its own size may pass through zero, and there the error is
// measured by this. Underdamped e^{−d/2}/x^{k+1}, never more than the bound 1/(k+1)!; overdamped γ_k > 0 for k ≥ 0.
double amplitude(int k, double x, double d) {
  double bound = 1.0;
  for (int i = 2; i <= k + 1; ++i) bound /= i;
  if (d < 2.0 * x) return std::exp(-0.5 * d) * std::min(bound, std::pow(x, -(k + 1)));
  if (k >= 0) return 0.0;
  const double w = std::sqrt((0.5 * d - x) * (0.5 * d + x)), fast = 0.5 * d + w, slow = x * x / fast;
  return std::exp(-slow) * std::min(1.0 + slow, (slow + fast * std::exp(-2.0 * w)) / (2.0 * w));
}

double magnitude(Quad value) { return std::fabs(static_cast<double>(value)); }

const std::vector<double> damping_ratios = {0.0,   1e-9, 1e-4, 0.03, 0.3, 0.7, 0.9, 0.999, 1.0 - 1e-9, 1.0, 1.0 + 1e-9,
                                            1.001, 1.05, 1.3,  2.0,  2.4, 2.6, 4.0, 30.0,  1e3,        1e6};

TEST(BeamOscillator, IsExactToRoundingForAllFrequenciesAndDampings) {
  // 1e-13 relative to the natural scale of each function: the bound that the header promises.
  double worst = 0.0;
  std::string where;
  beam::testing::Noise noise;
  for (const double zeta : damping_ratios) {
    for (double exponent = -9.0; exponent <= 7.0; exponent += 0.11) {
      const double t = std::pow(10.0, -1.5 + 1.5 * noise());
      const double omega = std::pow(10.0, exponent + 0.05 * noise()) / t;
      const double c = 2.0 * zeta * omega;
      const Reference exact = reference(omega, c, t);
      const beam::OscillatorResponse response = beam::oscillator_response(omega, c, t);
      double power = 1.0;
      for (int k = -1; k <= 5; ++k) {
        const double computed = (k < 0 ? response.decay : response.G[static_cast<std::size_t>(k)]) / power;
        const Quad value = k < 0 ? exact.decay : exact.gamma[static_cast<std::size_t>(k)];
        const double scale = magnitude(value) + amplitude(k, omega * t, c * t);
        if (scale > 1e-60) {  // smaller adds nothing to a sum with anything else, and e^{−s} carries an error s ε
          const double error = magnitude(Quad(computed) - value) / scale;
          if (!(error <= worst)) {
            worst = error;
            where =
                "k = " + std::to_string(k) + ", ωt = " + std::to_string(omega * t) + ", ζ = " + std::to_string(zeta);
          }
        }
        power *= t;
      }
    }
  }
  EXPECT_LT(worst, 1e-13) << where;
  RecordProperty("worst", std::to_string(worst * 1e16) + "e-16 at " + where);
}

// That step by hand in quadruple precision, for the dissipation.
struct State {
  Quad eta, v, integral, integral_2;
};

State move(const Reference& g, double omega, double c, double t, Quad eta, Quad v, const std::array<double, 3>& f) {
  const Quad w2 = Quad(omega) * omega, T = t;
  std::array<Quad, 6> G;
  Quad power = T;
  for (std::size_t k = 0; k < 6; ++k) {
    G[k] = power * g.gamma[k];
    power *= T;
  }
  State m;
  m.eta = eta * (g.decay + c * G[0]) + v * G[0] + f[0] * G[1] + f[1] * G[2] + f[2] * G[3];
  m.v = v * g.decay + (f[0] - w2 * eta) * G[0] + f[1] * G[1] + f[2] * G[2];
  m.integral = eta * (G[0] + c * G[1]) + v * G[1] + f[0] * G[2] + f[1] * G[3] + f[2] * G[4];
  m.integral_2 = eta * (G[1] + c * G[2]) + v * G[2] + f[0] * G[3] + f[1] * G[4] + f[2] * G[5];
  return m;
}

double form(const std::array<double, 10>& Q, const std::array<double, 4>& z) {
  double sum = 0.0;
  std::size_t entry = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = i; j < 4; ++j) sum += (i == j ? 1.0 : 2.0) * Q[entry++] * z[i] * z[j];
  }
  return sum;
}

TEST(BeamOscillator, DissipationEqualsTheEnergyThatIsMissing) {
  // c∫η̇² = E(0) − E(t) + ∫f η̇,  ∫f η̇ = f(t)η(t) − f(0)η(0) − f₁∫η − f₂(t∫η − ∫∫η): in quadruple precision, where
  // the cancellation does not matter. Each motion alone, since the four may differ by orders of magnitude.
  double worst = 0.0;
  std::string where;
  beam::testing::Noise noise;
  for (const double zeta : damping_ratios) {
    if (zeta == 0.0) continue;
    for (double exponent = -4.0; exponent <= 6.0; exponent += 0.37) {
      const double t = std::pow(10.0, noise()), omega = std::pow(10.0, exponent) / t, c = 2.0 * zeta * omega;
      const Reference g = reference(omega, c, t);
      const std::array<double, 10> Q = beam::oscillator_dissipation(omega, c, t);
      const Quad w2 = Quad(omega) * omega, T = t;
      for (int pattern = 1; pattern < 16; ++pattern) {
        // v₀, f₀ (that is r), f₁, f₂ in units in which each moves the mode by about as much over the step
        const double scale_r = omega * t > 1.0 ? omega : 1.0 / t;
        const double v0 = pattern & 1 ? 1.0 : 0.0;
        const std::array<double, 3> f = {pattern & 2 ? scale_r : 0.0, pattern & 4 ? -scale_r / t : 0.0,
                                         pattern & 8 ? 2.0 * scale_r / (t * t) : 0.0};
        const State m = move(g, omega, c, t, 0, v0, f);
        const Quad end_force = f[0] + T * (f[1] + T * f[2] / 2);
        const Quad supplied = end_force * m.eta - f[1] * m.integral - f[2] * (T * m.integral - m.integral_2);
        const Quad missing = (Quad(v0) * v0 - m.v * m.v - w2 * m.eta * m.eta) / 2 + supplied;
        const double computed = form(Q, {v0, f[0], f[1], f[2]});
        const double error = magnitude(computed - missing) / magnitude(missing);
        if (!(error <= worst)) {
          worst = error;
          where = "ωt = " + std::to_string(omega * t) + ", ζ = " + std::to_string(zeta) + ", pattern " +
                  std::to_string(pattern);
        }
      }
    }
  }
  EXPECT_LT(worst, 1e-13) << where;
  RecordProperty("worst", std::to_string(worst * 1e16) + "e-16 at " + where);
}

TEST(BeamOscillator, DissipationEqualsTheQuadratureOfTheDampingForce) {
  // Composite Simpson rule on c η̇², η̇ by the reference: 4th order, 400 intervals; error bound (ωt/400)⁴/180 ~ 1e-9.
  for (const double zeta : {0.02, 0.6, 1.0, 3.0}) {
    for (const double x : {0.3, 2.0, 4.0}) {
      const double t = 0.7, omega = x / t, c = 2.0 * zeta * omega, v0 = 0.4, eta0 = -0.2;
      const std::array<double, 3> f = {1.0, -2.0, 5.0};
      constexpr int intervals = 400;
      double sum = v0 * v0;
      for (int i = 1; i <= intervals; ++i) {
        const double tau = t * i / intervals;
        const double v = static_cast<double>(move(reference(omega, c, tau), omega, c, tau, eta0, v0, f).v);
        sum += (i == intervals ? 1.0 : i % 2 == 1 ? 4.0 : 2.0) * v * v;
      }
      const double quadrature = c * sum * t / intervals / 3.0;
      const double computed =
          form(beam::oscillator_dissipation(omega, c, t), {v0, f[0] - omega * omega * eta0, f[1], f[2]});
      EXPECT_NEAR(computed, quadrature, 2e-7 * quadrature) << "ζ = " << zeta << ", ωt = " << x;
    }
  }
}

}  // namespace
