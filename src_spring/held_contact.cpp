#include "held_contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace spring {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon(), infinite = std::numeric_limits<double>::infinity();
/// For one force: brackets that only bisection closes take 60, the logarithm of 1/epsilon and some before.
constexpr int most_trials = 120;
/// Tolerances of the force: some hundred roundings of a top's step. Where the top's own error is larger, as over many
/// periods, what is missing ceases to fall; then it may be the most that the default tolerance adds up to.
constexpr double force_rounding = 1e-13, top_error = 1e-10;
/// Changes of depth below this part of it leave ten digits less to a difference quotient than to the middle's force.
constexpr double flat = 1e-6;
/// A secant whose ends are as near as this, of what they are differences of, is known to a part in a million.
constexpr double secant_rounding = 1e6 * epsilon;
/// Rounding of the energies of a step: less is not owed.
constexpr double energy_rounding = 1e-11;
/// Halvings of an interval, down to rounding.
constexpr int most_halvings = 60;

/// Where a message says that the tip goes: exactly, for steps of the size H that it is for; for others by
/// interpolation.
struct Ahead {
  const TipMessage& from;
  double H;
  /// Path in a time t without a force [m].
  double free(double t) const {
    if (t >= 2.0 * H) return t * from.forecast;
    return t * (from.velocity + (from.forecast - from.velocity) * t / (2.0 * H));
  }
  /// By 1 N held over t [m/N]: r₁ after H, r₁ + r₂ after 2H. A power of t through both, then on as between them.
  double response(double t) const {
    if (t == H || !from.predicts()) return from.response;
    if (t >= 2.0 * H) return from.response + from.response_2 * (t / H - 1.0);
    return from.response * std::pow(t / H, std::log2(std::clamp(1.0 + from.response_2 / from.response, 1.0, 4.0)));
  }
  /// By 1 N held over the first half of 2t [m/N].
  double response_2(double t) const { return t == H ? from.response_2 : response(2.0 * t) - response(t); }
};

}  // namespace

void HeldContact::begin(const TipMessage& arrived, double size, double y, const Top& top) {
  now_ = {};
  now_.held = 1.0;
  now_.size = size;
  now_.tip = now_.start = arrived.displacement;
  now_.depth = y - now_.tip;
  response_ = arrived.response;
  now_.yielding = response_ + size * size / 2 / mass_;  // of a free top
  choose(now_.tip + Ahead{arrived, size}.free(size), top);
}

void HeldContact::take_over(double tip, double size, double y, double force) {
  now_ = {};
  now_.held = 1.0;
  now_.size = size;
  now_.tip = tip;
  now_.depth = y - tip;
  now_.force = force;
}

void HeldContact::advance(const TipMessage& arrived, double size, double y, const Top& top) {
  const Ahead ahead{arrived, now_.size};
  const double C = now_.force, late = now_.tip - arrived.displacement, start = now_.depth + late;
  double stored = law_.energy(now_.depth) + now_.debt + now_.last * late;
  if (first_force_missed(arrived)) stored += now_.before * now_.path;
  response_ = ahead.response(size);
  now_.known = size == now_.size ? now_.foreseen : 0.0;
  now_.tip = now_.known != 0.0 ? now_.next : arrived.displacement + ahead.free(size) + response_ * C;
  now_.depth = y - now_.tip;

  const double rise = now_.depth - start, loss = std::max(0.0, now_.damping * rise);
  const double elastic = law_.energy(now_.depth);
  stored += C * rise - loss;
  now_.dissipated += loss;
  now_.debt = stored - elastic;
  if (std::abs(now_.debt) <= energy_rounding * (std::abs(C * rise) + law_.energy(start) + elastic)) now_.debt = 0.0;

  now_.steps = std::min(now_.steps + 1.0, 3.0);
  now_.foreseen = size == now_.size ? 1.0 : 0.0;
  now_.before = now_.last;
  now_.last = C;
  now_.path = arrived.displacement - now_.start;
  now_.start = arrived.displacement;
  now_.size = size;
  if (!(now_.yielding > 0.0 && now_.foreseen != 0.0)) now_.yielding = response_ + size * size / 2 / mass_;
  choose(arrived.displacement + ahead.free(2.0 * size) + C * ahead.response_2(size), top);
}

bool HeldContact::first_force_missed(const TipMessage& arrived) const {
  constexpr double rounding = 1e-6, unexplained = 0.01;
  const double part = std::abs(arrived.response_2 * now_.before), path = now_.size * std::abs(arrived.forecast);
  const double miss = now_.tip - arrived.response_2 * now_.before - arrived.displacement;
  return now_.steps == 2.0 && now_.known != 0.0 && part > rounding * path && std::abs(miss) < unexplained * part;
}

/// The force over the next step, at whose end the tip is at `free` without it.
void HeldContact::choose(double free, const Top& top) {
  const Found law = solve(now_.depth, free, top);
  now_.force = law.force;
  now_.damping = std::isfinite(law.force) ? mean(now_.depth, law.end).damping : 0.0;
  if (now_.debt != 0.0 && law.force > 0.0 && std::isfinite(law.force)) {
    now_.force = repaying(law);
    if (!std::isfinite(top(now_.force))) top(now_.force = law.force);
  }
  now_.next = free + response_ * now_.force;
  if (std::isfinite(now_.next + now_.depth + law_.energy(now_.depth))) return;
  const double tip = now_.tip;
  now_ = {};  // finite, as what is saved must be
  now_.held = now_.none = 1.0;
  now_.tip = tip;
}

/// With what is owed, [Φ⁺ − Φ − owed]/(δ⁺ − δ): of both forces after which nothing is, that on the law's side; where
/// there is none, the one after which the least is. What is owed after a step is a concave function of its force, of
/// which the law's gives `debt` back, as does the one that keeps the depth. At most twice the law's force.
double HeldContact::repaying(const Found& law) const {
  const auto depth = [&](double C) { return law.end - now_.yielding * (C - law.force); };
  const auto owed = [&](double C) {
    return now_.debt + law_.energy(now_.depth) + (C - now_.damping) * (depth(C) - now_.depth) - law_.energy(depth(C));
  };
  const auto slope = [&](double C) {
    return depth(C) - now_.depth - now_.yielding * (C - now_.damping - law_.elastic(depth(C)));
  };
  const auto between = [](double from, double to, const auto& past) {
    for (int i = 0; i < most_halvings; ++i) {
      const double middle = from + (to - from) / 2;
      (past(middle) ? to : from) = middle;
    }
    return from;
  };
  const double still = std::clamp(law.force + (law.end - now_.depth) / now_.yielding, 0.0, 2.0 * law.force);
  const bool less = still < law.force;
  if (now_.debt > 0.0) return between(law.force, less ? 2.0 * law.force : 0.0, [&](double C) { return owed(C) < 0.0; });
  const double least = between(law.force, still, [&](double C) { return less == (slope(C) > 0.0); });
  return between(law.force, least, [&](double C) { return owed(C) > 0.0; });
}

/// C with C = mean(start, end(C)), end(C) = top(C) − free − r₁C. The depth at the end is all but affine in the force,
/// so each trial tells where it would be under others; without a contact one trial does, in one two. Where the top
/// strikes the foundation brackets close.
HeldContact::Found HeldContact::solve(double start, double free, const Top& top) {
  struct Trial {
    double force, end, missing;
  } last{0.0, 0.0, infinite};
  double low = 0.0, high = infinite, force = std::max(0.0, 2.0 * now_.last - now_.before);
  for (int trial = 0; trial < most_trials; ++trial) {
    const double place = top(force);
    double next = 0.0;
    if (std::isfinite(place)) {
      const double end = place - free - response_ * force;
      const Mean wanted = mean(start, end);
      if (!std::isfinite(wanted.force)) break;
      const double missing = wanted.force - force;
      const double depths = std::abs(place) + std::abs(free) + response_ * force;
      const double accuracy = std::abs(missing) < 0.5 * last.missing ? 4.0 * epsilon : top_error;
      if (std::abs(missing) <= force_rounding * force + wanted.rounding + wanted.by_end * accuracy * depths)
        return {force, end};
      (missing > 0.0 ? low : high) = force;
      if (last.missing < infinite && std::abs(end - last.end) > secant_rounding * depths)
        now_.yielding = std::max(response_, (last.end - end) / (force - last.force));
      last = {force, end, std::abs(missing)};
      next = solve_affine(start, end, force);
    } else if (force > low) {
      high = force;  // pressed so hard, the top runs away
    } else {
      break;
    }
    if (high < infinite && (!(low <= next && next < high) || trial > most_trials / 6)) next = low + (high - low) / 2;
    const bool closed = high < infinite && high - low <= 4.0 * epsilon * high;
    if (closed || next == force) return {std::isfinite(place) ? force : infinite, last.end};
    force = next;
  }
  return {infinite, last.end};
}

/// C with C = mean(start, end(C)), end(C) = `end` − yielding (C − `force`): Newton's method, which asks for no trial.
double HeldContact::solve_affine(double start, double end, double force) const {
  // Convergence is quadratic: of the last change its square is left. More iterations than some tens take only powers
  // so high that another trial does as well.
  constexpr double small_change = 1e-8;
  constexpr int most_iterations = 40;
  const double at_zero = end + now_.yielding * force;
  for (int i = 0; i < most_iterations; ++i) {
    const Mean wanted = mean(start, at_zero - now_.yielding * force);
    const double before = force;
    force = std::max(0.0, force + (wanted.force - force) / (1.0 + wanted.by_end * now_.yielding));
    if (std::abs(force - before) <= small_change * force) break;
  }
  return force;
}

HeldContact::Mean HeldContact::mean(double start, double end) const {
  const double rise = end - start, factor = law_.damping_factor(rise / now_.size);
  double force = 0.0, by_end = 0.0, rounding = 0.0;
  // Where the difference quotient is rounding, the middle is as good.
  if (std::abs(rise) <= flat * (std::abs(end) + std::abs(start))) {
    const double middle = (start + end) / 2;
    force = law_.elastic(middle);
    if (middle > 0.0) by_end = law_.slopes(middle, 0.0).force_by_depth / 2;
  } else {
    const double before = law_.energy(start), after = law_.energy(end);
    force = (after - before) / rise;
    by_end = (law_.elastic(end) - force) / rise;
    rounding = 4.0 * epsilon * std::max(before, after) / std::abs(rise);
  }
  const double damping = factor > 0.0 && rise != 0.0 ? (factor - 1.0) / rise * force : 0.0;  // C χ/H
  const double c = law_.viscosity() / now_.size, viscous = c * (std::max(end, 0.0) - std::max(start, 0.0));
  if (factor * force + viscous <= 0.0) return {0.0, 0.0, 0.0, -force};
  return {factor * force + viscous, factor * by_end + damping + (end > 0.0 ? c : 0.0), factor * rounding,
          (factor - 1.0) * force + viscous};
}

}  // namespace spring
