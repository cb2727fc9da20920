#include "modal_oscillator.hpp"

#include <algorithm>
#include <cmath>

#include "eigen.hpp"
#include "gauss.hpp"

namespace beam {
namespace {

using Eigen::Matrix4d;
using Eigen::Vector4d;

constexpr int max_order = 5;
constexpr int n_terms = 24;

// gamma[k + 1] = γ_k, k = −1 … 5
using Gamma = std::array<double, max_order + 2>;

constexpr std::array<double, n_terms + max_order + 2> make_inverse_factorials() {
  std::array<double, n_terms + max_order + 2> values{};
  double factorial = 1.0;
  values[0] = 1.0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    factorial *= static_cast<double>(i);
    values[i] = 1.0 / factorial;
  }
  return values;
}

constexpr auto inverse_factorial = make_inverse_factorials();

// Roots of μ² + dμ + x² = 0 as −d/2 ± iw (complex) or −d/2 ± w (real).
struct Roots {
  double x, d;      // ωt, ct
  double w;         // |√(x² − d²/4)|
  double rounding;  // of w, if that is a phase: what its last digit leaves
  bool complex;
  double slow;  // |μ₊|, the smaller modulus
  double fast;  // |μ₋|
};

Roots roots(double omega, double c, double t) {
  const double x = omega * t, d = c * t, half = 0.5 * c;
  const double frequency = std::sqrt(std::abs(omega - half) * (omega + half));  // nothing cancels
  if (omega <= half) {
    const double w = frequency * t, fast = 0.5 * d + w;
    return {x, d, w, 0.0, false, x * (x / fast), fast};
  }
  if (frequency < 0.5 * omega) return {x, d, frequency * t, 0.0, true, x, x};
  // The phase may be large where the damping is small: it is ωt, to twice the digits, less a small part.
  const double less = half / (omega + frequency) * half * t, w = x - less;
  return {x, d, w, std::fma(omega, t, -x) + ((x - w) - less), true, x, x};
}

// Power series; needs |μ±| ≤ 1. With b_n the n-th derivative of g at 0: γ_k = Σ b_n/(n+k)!.
Gamma by_series(double x, double d) {
  std::array<double, n_terms> b{};
  b[0] = 0.0;
  b[1] = 1.0;
  for (std::size_t n = 2; n < n_terms; ++n) b[n] = -d * b[n - 1] - x * x * b[n - 2];
  Gamma gamma{};
  for (std::size_t k = 0; k < gamma.size(); ++k) {  // order k − 1
    double sum = 0.0;
    for (std::size_t n = n_terms - 1; n >= 1; --n) sum += b[n] * inverse_factorial[n + k - 1];
    gamma[k] = sum;
  }
  return gamma;
}

// From t to 2t (x and d are those of t): the k-fold integral over the second half continues the motion that the
// first half ends with, γ₀ and γ₋₁, on top of the polynomial that the first half's integrals leave.
Gamma doubled(const Gamma& a, double x, double d) {
  const double y = a[1], dy = a[0];
  Gamma r{};
  r[0] = dy * dy - (x * y) * (x * y);
  double power = 0.5;
  for (std::size_t k = 1; k < a.size(); ++k) {  // order k − 1
    double sum = y * (a[k - 1] + d * a[k]) + dy * a[k];
    for (std::size_t j = 0; j + 1 < k; ++j) sum += a[k - j] * inverse_factorial[j];
    r[k] = power * sum;
    power *= 0.5;
  }
  return r;
}

// γ_k from γ₋₁ and γ₀ by the recurrence; loses nothing while |μ₊| ≥ 2.
void recur(Gamma& gamma, double x, double d) {
  const double w = 1.0 / x / x;
  for (std::size_t k = 2; k < gamma.size(); ++k) {
    gamma[k] = (inverse_factorial[k - 2] - gamma[k - 2] - d * gamma[k - 1]) * w;
  }
}

struct SineCosine {
  double sine, cosine;
};

SineCosine sine_cosine(const Roots& z) {
  const double s = std::sin(z.w), c = std::cos(z.w);
  return {s + z.rounding * c, c - z.rounding * s};
}

Gamma by_closed_form(const Roots& z) {
  Gamma gamma{};
  if (z.complex) {
    const double e = std::exp(-0.5 * z.d);
    const SineCosine w = sine_cosine(z);
    const double sinc = z.w > 0.0 ? w.sine / z.w : 1.0;
    gamma[1] = e * sinc;
    gamma[0] = e * (w.cosine - 0.5 * z.d * sinc);
  } else {
    gamma[1] = std::exp(-z.slow) * (z.w > 0.0 ? -std::expm1(-2.0 * z.w) / (2.0 * z.w) : 1.0);
    gamma[0] = std::exp(-z.fast) - z.slow * gamma[1];
  }
  recur(gamma, z.x, z.d);
  return gamma;
}

// Strongly overdamped: with the roots far apart, γ_k = (φ_k(μ₊) − γ_{k−1})/|μ₋|, φ_k = exp[0,…,0,μ₊], loses nothing.
Gamma by_separation(const Roots& z) {
  const Gamma phi = by_series(0.0, z.slow);  // whose roots are 0 and μ₊: phi[k] = φ_k
  Gamma gamma{};
  gamma[1] = (phi[0] - std::exp(-z.fast)) / (2.0 * z.w);
  gamma[0] = std::exp(-z.fast) - z.slow * gamma[1];
  for (std::size_t k = 1; k + 1 < gamma.size(); ++k) gamma[k + 1] = (phi[k] - gamma[k]) / z.fast;
  return gamma;
}

Gamma gamma_functions(const Roots& z) {
  if (z.fast <= 1.0) return by_series(z.x, z.d);
  if (z.fast <= 4.0) {
    Gamma gamma = by_series(0.25 * z.x, 0.25 * z.d);
    gamma = doubled(gamma, 0.25 * z.x, 0.25 * z.d);
    return doubled(gamma, 0.5 * z.x, 0.5 * z.d);
  }
  if (z.slow >= 2.0) return by_closed_form(z);
  return by_separation(z);
}

}  // namespace

OscillatorResponse oscillator_response(double omega, double c, double t) {
  const Gamma gamma = gamma_functions(roots(omega, c, t));
  OscillatorResponse response;
  response.decay = gamma[0];
  double power = t;
  for (std::size_t k = 0; k < response.G.size(); ++k) {
    response.G[k] = power * gamma[k + 1];
    power *= t;
  }
  return response;
}

UndampedStep undamped_step(double omega, double t) {
  const SineCosine x = sine_cosine(roots(omega, 0.0, t));
  const double sign = x.cosine >= 0.0 ? 1.0 : -1.0;
  const double sine = sign * x.sine, cosine = sign * x.cosine;
  return {sign, sine / (1.0 + cosine) / omega, sine / omega};
}

std::array<double, 10> oscillator_dissipation(double omega, double c, double t) {
  // In units of the current length t_j the state is z = (v, r t_j, f₁ t_j², f₂ t_j³), and v(σ t_j) = basis · z.
  int doublings = 0;
  std::frexp(roots(omega, c, t).fast, &doublings);  // |μ₋| < 2^doublings
  doublings = std::max(doublings, 0);
  double length = std::ldexp(t, -doublings);

  Matrix4d Q = Matrix4d::Zero();
  at_gauss_points([&](double sigma, double weight) {
    const Gamma gamma = by_series(sigma * omega * length, sigma * c * length);
    const Vector4d basis(gamma[0], sigma * gamma[1], sigma * sigma * gamma[2], sigma * sigma * sigma * gamma[3]);
    Q += weight * basis * basis.transpose();
  });

  const Vector4d unit(0.5, 0.25, 0.125, 0.0625);  // of z, from t_j to 2 t_j; Q has one more ½, its own
  for (int step = 0; step < doublings; ++step) {
    const Roots z = roots(omega, c, length);
    const Gamma g = gamma_functions(z);
    Matrix4d P;
    P << g[0], g[1], g[2], g[3],                                                     //
        -z.x * z.x * g[1], g[0] + z.d * g[1], g[1] + z.d * g[2], g[2] + z.d * g[3],  //
        0.0, 0.0, 1.0, 1.0,                                                          //
        0.0, 0.0, 0.0, 1.0;
    const Matrix4d R = Q + P.transpose() * Q * P;
    Q = 2.0 * unit.asDiagonal() * R * unit.asDiagonal();
    length *= 2.0;
  }

  std::array<double, 10> form{};
  std::size_t entry = 0;
  for (int i = 0; i < 4; ++i) {
    for (int j = i; j < 4; ++j) form[entry++] = c * std::pow(t, 1 + i + j) * Q(i, j);
  }
  return form;
}

}  // namespace beam
