// Shared by the spring's tests: exact solutions, and steps through them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "spring.hpp"

namespace spring_test {

using spring::ContactLaw;
using spring::Inputs;
using spring::Parameters;
using spring::Spring;

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr double pi = 3.14159265358979323846;

/// Jacobi's sn, cn, dn of argument u and parameter 0 ≤ m < 1 by the descending Landen (AGM) transformation;
/// Abramowitz & Stegun 16.4. Good to a few ulp for |u| up to some periods.
struct Jacobi {
  double sn, cn, dn;
  Jacobi(double u, double m) {
    constexpr int depth = 8;  // quadratic convergence: m = 0.99 needs 5
    long double a[depth + 1], c[depth + 1];
    long double b = std::sqrt(1.0L - m);
    a[0] = 1.0L;
    c[0] = std::sqrt(static_cast<long double>(m));
    for (int n = 0; n < depth; ++n) {
      a[n + 1] = (a[n] + b) / 2;
      c[n + 1] = (a[n] - b) / 2;
      b = std::sqrt(a[n] * b);
    }
    long double phi = std::ldexp(a[depth] * u, depth);
    for (int n = depth; n > 0; --n) phi = (phi + std::asin(c[n] / a[n] * std::sin(phi))) / 2;
    sn = static_cast<double>(std::sin(phi));
    cn = static_cast<double>(std::cos(phi));
    dn = static_cast<double>(std::sqrt(1.0L - m * std::sin(phi) * std::sin(phi)));
  }
};

/// Complete elliptic integral of the first kind K(m) = π / (2 AGM(1, √(1−m))).
inline double complete_elliptic(double m) {
  long double a = 1.0L, b = std::sqrt(1.0L - m);
  for (int n = 0; n < 8; ++n) {
    const long double next = (a + b) / 2;
    b = std::sqrt(a * b);
    a = next;
  }
  return static_cast<double>(3.141592653589793238462643383279502884L / (2 * a));
}

/// Free, undamped Duffing motion m = 1 from rest at A.
///   k2 > 0: y = A cn(ωt|m), ω² = k1 + k2A², m = k2A²/2ω².   k2 < 0: y = A sn(ωt + K|m), ω² = k1 + k2A²/2, m =
///   −k2A²/2ω².
struct Duffing {
  double A, omega, m, K;
  bool softening;
  Duffing(double k1, double k2, double amplitude)
      : A(amplitude),
        omega(std::sqrt(k1 + (k2 < 0 ? 0.5 : 1.0) * k2 * A * A)),
        m(std::abs(k2) * A * A / (2 * omega * omega)),
        K(complete_elliptic(m)),
        softening(k2 < 0) {}
  double period() const { return 4 * K / omega; }
  double displacement(double t) const {
    return softening ? A * Jacobi(omega * t + K, m).sn : A * Jacobi(omega * t, m).cn;
  }
  double velocity(double t) const {
    const Jacobi j(softening ? omega * t + K : omega * t, m);
    return softening ? A * omega * j.cn * j.dn : -A * omega * j.sn * j.dn;
  }
};

/// m = 1, from y and z.
inline Parameters duffing(double k1, double k2, double y = 0.0, double z = 0.0) {
  Parameters p;
  p.linear_stiffness = k1;
  p.cubic_stiffness = k2;
  p.displacement = y;
  p.velocity = z;
  return p;
}

/// A spring with k1 = 1 N/m and the contact law λ δ^p inside.
inline Parameters compliant(double lambda, double exponent) {
  Parameters p;
  p.contact_law = ContactLaw::normal_compliance;
  p.compliance_stiffness = lambda;
  p.compliance_exponent = exponent;
  return p;
}

/// A free mass above a stop at 0.
inline Parameters ball(double height, double velocity, double restitution) {
  Parameters p = duffing(0.0, 0.0, height, velocity);
  p.stop_enabled = true;
  p.stop_position = 0.0;
  p.restitution = restitution;
  return p;
}

inline Inputs weight(double force) {
  Inputs inputs;
  inputs.external_force[0] = -force;
  return inputs;
}

/// y(0), ẏ(0) under m ÿ + c ẏ + k y = F, constant, 0 ≤ c < 2√(km): closed form.
struct LinearOscillator {
  double m, c, k, F, y0, z0;
  double decay() const { return c / (2 * m); }
  double frequency() const { return std::sqrt(k / m - decay() * decay()); }
  double displacement(double t) const {
    const double d = decay(), w = frequency(), x0 = y0 - F / k;
    return F / k + std::exp(-d * t) * (x0 * std::cos(w * t) + (z0 + d * x0) / w * std::sin(w * t));
  }
  double velocity(double t) const {
    const double d = decay(), w = frequency(), x0 = y0 - F / k;
    return std::exp(-d * t) * (z0 * std::cos(w * t) - (d * z0 + (d * d + w * w) * x0) / w * std::sin(w * t));
  }
};

inline double energy(const spring::Spring& s) { return s.kinetic_energy() + s.potential_energy() + s.contact_energy(); }

/// Largest distance of equally spaced values from their least-squares line.
inline double roughness(const std::vector<double>& values) {
  const long double n = static_cast<long double>(values.size());
  long double sum = 0, moment = 0, square = 0, worst = 0;
  const auto x = [n](std::size_t i) { return static_cast<long double>(i) - (n - 1) / 2; };
  const auto v = [&values](std::size_t i) { return static_cast<long double>(values[i]) - values[0]; };
  for (std::size_t i = 0; i < values.size(); ++i) {
    sum += v(i);
    moment += x(i) * v(i);
    square += x(i) * x(i);
  }
  for (std::size_t i = 0; i < values.size(); ++i)
    worst = std::max(worst, std::abs(v(i) - sum / n - moment / square * x(i)));
  return static_cast<double>(worst);
}

/// A state as numbers, to compare.
template <class State>
std::vector<double> numbers(const State& state) {
  std::vector<double> all(sizeof state / sizeof(double));
  std::memcpy(all.data(), &state, sizeof state);
  return all;
}

}  // namespace spring_test
