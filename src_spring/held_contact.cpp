#include "held_contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "text.hpp"

namespace spring {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon(), infinite = std::numeric_limits<double>::infinity();
/// For one force: brackets that only bisection closes take 60, the logarithm of 1/epsilon and some before.
constexpr int most_trials = 120;
/// Of the force: some hundred roundings of a top's step. Where the top's own error is larger, as over many periods,
/// what is missing ceases to fall; then it may be the most that the default tolerance adds up to.
constexpr double force_rounding = 1e-13, top_error = 1e-10;
/// Changes of depth below this part of it leave ten digits less to a difference quotient than to the middle's force.
constexpr double flat = 1e-6;
/// A secant whose ends are as near as this, of what they are differences of, is known to a part in a million.
constexpr double secant_rounding = 1e6 * epsilon;

}  // namespace

HeldContact::HeldContact(const Compliance& law, double mass, double size, const std::array<double, 2>& response)
    : law_(law), yielding_(response[0] + size * size / 2 / mass), size_(size), response_(response) {
  if (!(response[0] > 0.0)) {
    throw std::invalid_argument(
        "spring: tip_response = " + number(response[0]) +
        ": must be > 0 where communication_step > 0; it is an output of the beam with the same one");
  }
}

bool HeldContact::unanswered(const TipMessage& arrived) const {
  const auto nothing = [](const TipMessage& m) { return m.displacement == 0.0 && m.velocity == 0.0; };
  return nothing(arrived) && !nothing(now_.given);
}

void HeldContact::begin(const TipMessage& arrived, bool initial, double y, const Top& top) {
  if (initial) now_.given = arrived;
  const bool silent = unanswered(arrived);
  now_.first = silent ? now_.given : arrived;
  now_.tip = now_.first.displacement;
  now_.depth = y - now_.tip;
  now_.next_free = now_.tip + size_ * now_.first.velocity;
  now_.yielding = yielding_;  // the force follows what has arrived, not what arrived before it
  send(silent ? 0.0 : solve(now_.depth, now_.next_free, top), now_.next_free);
}

void HeldContact::advance(const TipMessage& arrived, double y, const Top& top) {
  const TipMessage& from = started() ? arrived : now_.first;
  now_.steps = std::min(now_.steps + 1.0, 3.0);
  now_.tip = now_.next;
  now_.free = now_.next_free;
  const double depth = y - now_.tip;
  if (law_.damped())
    now_.dissipated += now_.force * (depth - now_.depth) - (law_.energy(depth) - law_.energy(now_.depth));
  now_.depth = depth;
  now_.next_free = from.displacement + 2.0 * size_ * from.velocity;
  now_.before = now_.last;
  now_.last = now_.force;
  const double free = now_.next_free + now_.last * response_[1];
  send(solve(depth, free, top), free);
}

/// C with C = mean(start, end(C)), end(C) = top(C) − free − r₁C. The depth at the end is all but affine in the force,
/// so each trial tells where it would be under others; without a contact one trial does, in one two. Where the top
/// strikes the foundation brackets close.
double HeldContact::solve(double start, double free, const Top& top) {
  double low = 0.0, high = infinite, last = 0.0, last_end = 0.0, last_missing = infinite;
  double force = std::max(0.0, 2.0 * now_.last - now_.before);
  for (int trial = 0; trial < most_trials; ++trial) {
    const double reached = top(force);
    double next = 0.0;
    if (std::isfinite(reached)) {
      const double end = reached - free - response_[0] * force;
      const Mean wanted = mean(start, end);
      if (!std::isfinite(wanted.force)) return infinite;
      const double missing = wanted.force - force;
      const double depths = std::abs(reached) + std::abs(free) + response_[0] * force;
      const double accuracy = std::abs(missing) < 0.5 * last_missing ? 4.0 * epsilon : top_error;
      if (std::abs(missing) <= force_rounding * force + wanted.rounding + wanted.by_end * accuracy * depths)
        return force;
      (missing > 0.0 ? low : high) = force;
      const bool known = last_missing < infinite && std::abs(end - last_end) > secant_rounding * depths;
      if (known) now_.yielding = std::max(response_[0], (last_end - end) / (force - last));
      last_missing = std::abs(missing);
      last = force;
      last_end = end;
      next = solve_affine(start, end, force);
    } else if (force > low) {
      high = force;  // pressed so hard, the top runs away
    } else {
      return infinite;
    }
    if (high < infinite && (!(low <= next && next < high) || trial > most_trials / 6)) next = low + (high - low) / 2;
    const bool closed = high < infinite && high - low <= 4.0 * epsilon * high;
    if (closed || next == force) return std::isfinite(reached) ? force : infinite;
    force = next;
  }
  return infinite;
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

void HeldContact::send(double force, double free) {
  now_.next = free + response_[0] * force;
  now_.force = std::isfinite(now_.next + law_.energy(now_.depth)) ? force : infinite;
}

HeldContact::Mean HeldContact::mean(double start, double end) const {
  const double rise = end - start, factor = law_.damping_factor(rise / size_);
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
  return {factor * force, factor * by_end + damping, factor * rounding};
}

}  // namespace spring
