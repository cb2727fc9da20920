#include "exact_modes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "../fmus/common/text.hpp"

namespace beam {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double pi = 3.141592653589793;
constexpr double epsilon = std::numeric_limits<double>::epsilon();
/// Up to this |σ| integrals are taken from power series, as the closed forms divide by σ.
constexpr double small_sigma = 4.0;
/// How far the energy of a moving start may be off, relative; 1e-3 is left by 10 modes, 1e-6 by 100.
constexpr double start_energy_tolerance = 0.05;
constexpr std::size_t powers = Loads::point - Loads::distributed;
using Moments = std::array<double, powers>;  ///< ∫ x^j f dx over the length

[[noreturn]] void throw_out_of_range() {
  throw std::runtime_error("beam: the parameters leave the range of floating-point numbers");
}

double length(const std::array<double, 2>& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1]); }

/// cosh √σ and sinh √σ/√σ, divided by e^{√σ} where σ > 0, and what 1 becomes by that.
struct Wave {
  explicit Wave(double sigma_) : sigma(sigma_) {
    const double root = std::sqrt(std::abs(sigma));
    if (sigma > 0.0) {
      one = std::exp(-root);
      C = 0.5 * (1.0 + one * one);
      S = -0.5 * std::expm1(-2.0 * root) / root;
    } else {
      C = std::cos(root);
      S = root > 0.0 ? std::sin(root) / root : 1.0;
      // Zeros of C that are passed; at a zero its sign decides, so that no count contradicts it.
      const double passed = root / pi + 0.5;
      zeros = static_cast<long>(passed);
      if ((zeros % 2 == 0) != (C >= 0.0)) zeros += passed - static_cast<double>(zeros) < 0.5 ? -1 : 1;
    }
  }
  /// dS/dσ
  double slope_of_S() const {
    return std::abs(sigma) < 1e-4 ? one * (1.0 / 6.0 + sigma / 60.0 + sigma * sigma / 1680.0) : (C - S) / (2.0 * sigma);
  }
  double sigma, C = 1.0, S = 1.0, one = 1.0;
  long zeros = 0;
};

/// ∫ x^j C dx and ∫ x^j σS dx of C = cosh √σ x, σS = √σ sinh √σ x.
void moments(double sigma, Moments& of_C, Moments& of_sigma_S) {
  if (std::abs(sigma) > small_sigma) {  // by parts; only σ < 0 comes here
    const Wave end(sigma);
    of_C[0] = end.S;
    of_sigma_S[0] = end.C - 1.0;
    for (std::size_t j = 1; j < powers; ++j) {
      of_C[j] = end.S - static_cast<double>(j) / sigma * of_sigma_S[j - 1];
      of_sigma_S[j] = end.C - static_cast<double>(j) * of_C[j - 1];
    }
    return;
  }
  of_C = of_sigma_S = {};
  double term = 1.0;  // σ^m/(2m)!
  for (int m = 0; m < 14; ++m) {
    for (std::size_t j = 0; j < powers; ++j) {
      of_C[j] += term / static_cast<double>(2 * m + 1 + static_cast<int>(j));
      of_sigma_S[j] += term * sigma / ((2 * m + 1) * static_cast<double>(2 * m + 2 + static_cast<int>(j)));
    }
    term *= sigma / ((2 * m + 1) * (2 * m + 2));
  }
}

/// The two wave numbers at a frequency and what the frequency equation makes of them.
struct Waves {
  double a, b, c;
  double root;  ///< √((a − b)²/4 + c)
  double p1, p2, r;
  Wave first, second;

  /// `per_omega2`: a, b, c over ω².
  Waves(const std::array<double, 3>& per_omega2, double omega)
      : a(per_omega2[0] * omega * omega),
        b(per_omega2[1] * omega * omega),
        c(per_omega2[2] * omega * omega),
        root(std::sqrt(0.25 * (b - a) * (b - a) + c)),
        p1(b > a ? 0.5 * (b - a) + root : c / (root + 0.5 * (a - b))),
        p2(-c / p1),
        r(c / (p1 * p1)),
        first((c - a * b) / (0.5 * (a + b) + root)),
        second(-0.5 * (a + b) - root) {}

  /// F, and ω² dF/dω²; both divided by e^{√σ₁} where σ₁ > 0.
  double F() const { return 2.0 * first.one + (r + 1.0 / r) * first.C * second.C - (a + b) * first.S * second.S; }
  double slope() const {
    const double half = 0.5 * (b - a);
    const double change_root = (half * half + 0.5 * c) / root;
    const double change_2 = -0.5 * (a + b) - change_root;
    const double change_1 = (2.0 * a * b - c - first.sigma * change_2) / second.sigma;
    const double change_r = r * (1.0 - 2.0 * (half + change_root) / p1);
    return change_r * (1.0 - 1.0 / (r * r)) * first.C * second.C +
           (r + 1.0 / r) * 0.5 * (first.S * change_1 * second.C + first.C * second.S * change_2) -
           (a + b) * (first.S * second.S + first.slope_of_S() * change_1 * second.S +
                      first.S * second.slope_of_S() * change_2);
  }
  /// N(ω)
  long count() const {
    const double X = first.S * second.C + r * second.S * first.C;
    return first.zeros + second.zeros - (X * first.C * second.C < 0.0 ? 1 : 0) + (F() * X < 0.0 ? 1 : 0);
  }
};

class Cantilever {
 public:
  explicit Cantilever(const Parameters& p)
      : length(p.length),
        bending(p.young_modulus * p.second_moment_of_area),
        shear(p.shear_modulus * p.shear_coefficient * p.area),
        mass(p.density * p.area),
        per_omega2{p.density / p.young_modulus * length * length,
                   p.density / (p.shear_modulus * p.shear_coefficient) * length * length,
                   mass / bending * length * length * length * length} {}

  /// The lowest `count` frequencies [rad/s], ascending.
  std::vector<double> frequencies(Index count) const {
    const std::vector<double> sines = pinned_guided(count + 1);
    std::vector<double> omega(static_cast<std::size_t>(count));
    for (std::size_t i = 0; i < omega.size(); ++i) {
      const long k = static_cast<long>(i) + 1;
      // Where N changes by definition rounding decides; a little aside it does not.
      double low = i == 0 ? 0.5 * sines[0] : sines[i - 1], high = sines[i + 1];
      for (double aside = 1e-13; waves(low).count() >= k; aside *= 4.0) low *= 1.0 - std::min(aside, 0.5);
      for (double aside = 1e-13; waves(high).count() < k; aside *= 4.0) {
        high *= 1.0 + aside;
        if (!(high < std::numeric_limits<double>::max())) throw_out_of_range();
      }
      omega[i] = frequency(k, low, high);
    }
    return omega;
  }

  Waves waves(double omega) const { return {per_omega2, omega}; }

  const double length, bending, shear, mass;
  const std::array<double, 3> per_omega2;

 private:
  /// Of the beam pinned at x = 0 and guided at x = L: both roots ω² of (k² − a)(k² − b) = c for k = (m − ½)π.
  std::vector<double> pinned_guided(Index count) const {
    const double a = per_omega2[0], b = per_omega2[1], c = per_omega2[2];
    std::vector<double> omega;
    for (Index m = 0; m < count; ++m) {
      const double k = (static_cast<double>(m) + 0.5) * pi, k2 = k * k;
      const double sum = k2 * (a + b) + c;
      const double root = std::sqrt((k2 * (a - b)) * (k2 * (a - b)) + 2.0 * k2 * (a + b) * c + c * c);
      omega.push_back(k2 * std::sqrt(2.0 / (sum + root)));
      omega.push_back(std::sqrt((sum + root) / (2.0 * a * b)));
    }
    if (!std::all_of(omega.begin(), omega.end(), [](double w) { return std::isnormal(w); })) throw_out_of_range();
    std::sort(omega.begin(), omega.end());
    return omega;
  }

  /// The k-th, between `low` and `high`: bisection by N until it is alone there, then Newton's method, guarded.
  double frequency(long k, double low, double high) const {
    long below_low = waves(low).count(), below_high = waves(high).count();
    while ((below_low != k - 1 || below_high != k) && high - low > 2.0 * epsilon * high) {
      const double middle = 0.5 * (low + high);
      const long below = waves(middle).count();
      (below < k ? low : high) = middle;
      (below < k ? below_low : below_high) = below;
    }
    const bool rising = waves(high).F() > 0.0;
    double omega = 0.5 * (low + high);
    for (int i = 0; i < 100 && high - low > epsilon * high; ++i) {
      const Waves at = waves(omega);
      const double F = at.F(), step = 0.5 * F / at.slope();  // of ln ω
      ((F > 0.0) == rising ? high : low) = omega;
      const double next = omega * (1.0 - step);
      if (std::abs(step) < epsilon) return omega;
      omega = next > low && next < high ? next : 0.5 * (low + high);
    }
    return omega;
  }
};

/// One mode, in units of L but for its norm, which is φᵀMφ = 1 kg:
///     u = q C₂ + s σ₂S₂ + g u_g + h u_h,     θ = p₂ (q S₂ + s C₂) + g θ_g + h θ_h
/// with, of the first root, u_g = C₁, u_h = σ₁S₁, or, where those would cancel, u_g = e^{−αx}, u_h = e^{−α(1−x)}, α =
/// √σ₁.
class Mode {
 public:
  Mode(const Cantilever& beam, double omega)
      : waves_(beam.waves(omega)),
        decaying_(waves_.first.sigma > small_sigma),
        alpha_(std::sqrt(std::abs(waves_.first.sigma))) {
    const Wave &first = waves_.first, &second = waves_.second;
    const double p1 = waves_.p1, p2 = waves_.p2, r = waves_.r;
    // Bending strain θ' and shear strain u' − θ, over −b, at the tip of two shapes that are clamped at x = 0.
    std::array<std::array<double, 4>, 2> shapes;
    std::array<double, 2> bend, slide;
    if (decaying_) {
      const double e = std::exp(-alpha_), t = p1 / (alpha_ * p2);
      shapes = {{{-1.0, t, 1.0, 0.0}, {-e, -t * e, 0.0, 1.0}}};
      bend = {p1 * e, p1};
      slide = {-e / alpha_, 1.0 / alpha_};
    } else {
      const double C = first.C / first.one, S = first.S / first.one;
      shapes = {{{-1.0, 0.0, 1.0, 0.0}, {0.0, -1.0 / p2, 0.0, 1.0 / p1}}};
      bend = {p1 * C, first.sigma * S};
      slide = {S, C / p1};
    }
    for (std::size_t i = 0; i < 2; ++i) {
      bend[i] += p2 * (shapes[i][0] * second.C + shapes[i][1] * second.sigma * second.S);
      slide[i] += shapes[i][0] * second.S + shapes[i][1] * second.C;
    }
    // Both vanish; the one of larger terms tells the shape.
    const bool by_bend = length(bend) / p1 >= length(slide) * std::max(1.0, alpha_);
    const std::array<double, 2>& zero = by_bend ? bend : slide;
    for (std::size_t i = 0; i < 4; ++i) part_[i] = zero[1] * shapes[0][i] - zero[0] * shapes[1][i];

    // Norm: u(L) per tip force is Σ φ²/(ω_k² − ω²), θ(L) per tip moment likewise; both are N/F with known N.
    const double u = deflection(1.0), theta = rotation(1.0);
    const double rate = -omega * omega / waves_.slope();
    const double X = first.C * second.S + first.S * second.C / r;
    const double Y = first.sigma * first.S * second.C + second.sigma * second.S * first.C / r;
    const double of_u = -(1.0 + r) * Y * rate * beam.length / (beam.shear * waves_.b);
    const double of_theta = (1.0 + r) * X * rate * beam.length * beam.length * beam.length / beam.bending;
    const double norm = std::sqrt((of_u + of_theta) / (u * u + theta * theta));
    for (double& part : part_) part *= u < 0.0 ? -norm : norm;
  }

  double deflection(double x) const {
    const Local at = local(x);
    return part_[0] * at.C2 + part_[1] * at.sS2 + part_[2] * at.u_g + part_[3] * at.u_h;
  }
  /// θ L
  double rotation(double x) const {
    const Local at = local(x);
    const double second = waves_.p2 * (part_[0] * at.sS2 / waves_.second.sigma + part_[1] * at.C2);
    const double p1 = waves_.p1;
    if (decaying_) return second + p1 / alpha_ * (part_[3] * at.u_h - part_[2] * at.u_g);
    return second + p1 * (part_[2] * at.S1 + part_[3] * at.u_g);
  }
  /// ∫ x^j u dx
  Moments integrals() const {
    Moments C2, sS2, g, h;
    moments(waves_.second.sigma, C2, sS2);
    if (decaying_) {
      const double e = std::exp(-alpha_);
      g[0] = h[0] = (1.0 - e) / alpha_;
      for (std::size_t j = 1; j < powers; ++j) {
        g[j] = (static_cast<double>(j) * g[j - 1] - e) / alpha_;
        h[j] = (1.0 - static_cast<double>(j) * h[j - 1]) / alpha_;
      }
    } else {
      moments(waves_.first.sigma, g, h);
    }
    Moments all;
    for (std::size_t j = 0; j < powers; ++j)
      all[j] = part_[0] * C2[j] + part_[1] * sS2[j] + part_[2] * g[j] + part_[3] * h[j];
    return all;
  }

 private:
  struct Local {
    double C2, sS2, u_g, u_h, S1;
  };
  Local local(double x) const {
    const Wave second(waves_.second.sigma * x * x);
    Local at{second.C, waves_.second.sigma * x * second.S, 0.0, 0.0, 0.0};
    if (decaying_) {
      at.u_g = std::exp(-alpha_ * x);
      at.u_h = std::exp(-alpha_ * (1.0 - x));
    } else {
      const Wave first(waves_.first.sigma * x * x);
      at.u_g = first.C / first.one;
      at.S1 = x * first.S / first.one;
      at.u_h = waves_.first.sigma * at.S1;
    }
    return at;
  }

  Waves waves_;
  bool decaying_;
  double alpha_;
  std::array<double, 4> part_;
};

}  // namespace

long exact_mode_count(const Parameters& p, double omega) { return Cantilever(p).waves(omega).count(); }

Modes exact_modes(const Parameters& p) {
  const Cantilever beam(p);
  const Index n = p.n_modes;
  const double L = beam.length;
  const std::vector<double> omega = beam.frequencies(n);
  Modes modes;
  modes.omega = Eigen::Map<const VectorXd>(omega.data(), n);
  for (VectorXd* row : {&modes.tip, &modes.tip_rotation, &modes.linear_shape}) row->resize(n);
  for (VectorXd& load : modes.loads) load.setZero(n);
  modes.deflection.setZero(shape_points, n);
  modes.rotation.setZero(shape_points, n);
  for (Index k = 0; k < n; ++k) {
    const Mode mode(beam, modes.omega[k]);
    modes.tip[k] = mode.deflection(1.0);
    modes.tip_rotation[k] = mode.rotation(1.0) / L;
    const Moments moments = mode.integrals();
    for (std::size_t j = 0; j < powers; ++j) {
      modes.loads[Loads::distributed + j][k] = L * moments[j];
      modes.loads[Loads::point + j][k] = mode.deflection(p.point_force_position[j]);
    }
    modes.linear_shape[k] = beam.mass * L * L * moments[1];
    for (Index i = 1; i < shape_points; ++i) {
      const double x = static_cast<double>(i) / (shape_points - 1);
      modes.deflection(i, k) = mode.deflection(x);
      modes.rotation(i, k) = mode.rotation(x) / L;
    }
  }

  // u(L) of 1 N at x L, or u(x L) of 1 N at the tip.
  const auto influence = [&](double x) {
    return x * x * (0.5 - x / 6.0) * L * L * L / beam.bending + x * L / beam.shear;
  };
  const VectorXd omega2 = modes.omega.cwiseAbs2();
  const VectorXd weight = (omega2 / omega2[n - 1]).cwiseAbs2();  // κ
  const double kept = (modes.tip.array().square() / omega2.array()).sum();
  const double share = (weight.array() * modes.tip.array().square() / omega2.array()).sum();
  const double lacking = influence(1.0) - kept;
  if (!(lacking > -1e-9 * kept && std::isfinite(lacking / share))) throw_out_of_range();
  modes.tip.array() *= (1.0 + std::max(lacking, 0.0) / share * weight.array()).sqrt();
  modes.deflection.row(shape_points - 1) = modes.tip.transpose();

  const VectorXd raise = weight.cwiseProduct(modes.tip), compliance = modes.tip.cwiseQuotient(omega2);
  const auto complete = [&](VectorXd& load, double whole) {
    load += (whole - load.dot(compliance)) / raise.dot(compliance) * raise;
  };
  for (std::size_t j = 0; j < powers; ++j) {
    const double J = static_cast<double>(j);
    complete(modes.loads[Loads::distributed + j],
             L * ((0.5 / (J + 3.0) - 1.0 / (6.0 * (J + 4.0))) * L * L * L / beam.bending + L / (J + 2.0) / beam.shear));
    complete(modes.loads[Loads::point + j], influence(p.point_force_position[j]));
  }
  modes.loads[Loads::tip] = modes.tip;
  modes.loads[Loads::base_acceleration] = -beam.mass * modes.loads[Loads::distributed];
  VectorXd start = omega2.cwiseProduct(modes.linear_shape);
  complete(start, L);
  modes.linear_shape = start.cwiseQuotient(omega2);
  const double error = 3.0 * modes.linear_shape.squaredNorm() / (beam.mass * L * L * L) - 1.0;
  if (std::abs(error) > start_energy_tolerance &&
      (p.initial_deflection_slope != 0.0 || p.initial_velocity_slope != 0.0)) {
    throw std::invalid_argument("beam: n_modes = " + std::to_string(n) +
                                " is not allowed; the kinetic energy of a start u = s x would be " +
                                common::number(1.0 + error) + " times the true one; keep more modes, or use a mesh");
  }
  return modes;
}

}  // namespace beam
