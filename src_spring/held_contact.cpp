#include "held_contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "text.hpp"

namespace spring {

HeldContact::HeldContact(const Compliance& law, double mass, double size, const std::array<double, 2>& response)
    : law_(law), yielding_(size * size / 2 / mass), size_(size), response_(response) {
  if (!(response[0] > 0.0)) {
    throw std::invalid_argument(
        "spring: tip_response = " + number(response[0]) +
        ": must be > 0 where communication_step > 0; it is an output of the beam with the same one");
  }
}

void HeldContact::begin(const TipMessage& seen, bool initial, double y, const Top& top) {
  if (initial) now_.given = seen;
  const auto nothing = [](const TipMessage& m) { return m.displacement == 0.0 && m.velocity == 0.0; };
  const bool silent = nothing(seen) && !nothing(now_.given);
  missed_[untold] = silent ? 1 : 0;
  now_.first = silent ? now_.given : seen;
  now_.tip = now_.first.displacement;
  now_.depth = y - now_.tip;
  now_.said_next = now_.tip + size_ * now_.first.velocity;
  now_.force = 0.0;  // where the search starts: the force follows what is seen, not what was seen before it
  send(silent ? 0.0 : solve(now_.depth, now_.said_next, top), now_.said_next);
}

void HeldContact::advance(const TipMessage& seen, double y, const Top& top) {
  if (started()) compare(seen);
  const TipMessage& from = started() ? seen : now_.first;
  now_.steps = std::min(now_.steps + 1.0, 3.0);
  now_.tip = now_.next;
  now_.said = now_.said_next;
  const double depth = y - now_.tip;
  if (law_.damped())
    now_.dissipated += now_.force * (depth - now_.depth) - (law_.energy(depth) - law_.energy(now_.depth));
  now_.depth = depth;
  now_.said_next = from.displacement + 2.0 * size_ * from.velocity;
  now_.before = now_.last;
  now_.last = now_.force;
  const double free = now_.said_next + now_.last * response_[1];
  send(solve(depth, free, top), free);
}

void HeldContact::compare(const TipMessage& seen) {
  constexpr double rounding = 1e-6, noticeable = 0.05, whole = 0.75;  // of the way in a step
  const auto& [r1, r2] = response_;
  reach_ = std::max({reach_, size_ * std::abs(seen.velocity), r1 * now_.force});
  const auto off = [&seen](double tip) { return std::abs(seen.displacement - tip); };
  const double miss = off(now_.tip);
  if (now_.steps < 2.0) {  // the first step's mean velocity was a guess
    if (miss > whole * reach_) missed_[untold] = 1;
    return;
  }
  if (miss <= rounding * reach_) return;
  if (now_.steps < 3.0 && off(now_.said + r1 * now_.last) < 0.01 * miss) {
    missed_[untold] = 1;  // it has met the second force, but not the first
  } else if (off(now_.said + r2 * now_.last + r1 * now_.force) < 0.01 * miss) {
    ++missed_[late];
  } else if (off(now_.said + r1 * now_.before + r2 * now_.last) < 0.01 * miss) {
    ++missed_[swapped];
  } else if (miss > noticeable * reach_) {
    ++missed_[elsewhere];
  }
}

/// C with C = mean(start, end(C)), end(C) = top(C) − free − r₁C: Newton's method between brackets, with the top's
/// slope from the last two trials, at first that of a free mass. Without a contact one trial does, in one two or three;
/// where the top strikes the foundation the brackets close.
double HeldContact::solve(double start, double free, const Top& top) const {
  constexpr double epsilon = std::numeric_limits<double>::epsilon(), infinite = std::numeric_limits<double>::infinity();
  double low = 0.0, high = infinite, yielding = response_[0] + yielding_;
  double force = std::isfinite(now_.force) ? now_.force : 0.0, last = force, last_reached = 0.0,
         last_missing = infinite;
  for (int trial = 0; trial < 120; ++trial) {
    const double reached = top(force);
    double next = 0.0;
    if (std::isfinite(reached)) {
      const double end = reached - free - response_[0] * force;
      const Mean wanted = mean(start, end);
      if (!std::isfinite(wanted.force)) return infinite;
      const double missing = wanted.force - force;
      const double depths = std::abs(reached) + std::abs(free) + response_[0] * force;
      // What no longer falls is rounding, or the error of the top's step where that is many periods long.
      const double accuracy = std::abs(missing) < 0.5 * last_missing ? 4.0 * epsilon : 1e-10;
      if (std::abs(missing) <= 1e-13 * force + wanted.by_end * accuracy * depths) return force;
      last_missing = std::abs(missing);
      (missing > 0.0 ? low : high) = force;
      if (force != last) yielding = std::max(response_[0], response_[0] - (reached - last_reached) / (force - last));
      last = force;
      last_reached = reached;
      next = force + missing / (1.0 + wanted.by_end * yielding);
    } else if (force > low) {
      high = force;  // pressed so hard, the top runs away
    } else {
      return infinite;
    }
    if (high < infinite && (!(low <= next && next < high) || trial > 20)) next = low + (high - low) / 2;
    const bool closed = high < infinite && high - low <= 4.0 * epsilon * high;
    if (closed || next == force) return std::isfinite(reached) ? force : infinite;
    force = next;
  }
  return infinite;
}

void HeldContact::send(double force, double free) {
  now_.next = free + response_[0] * force;
  now_.force = std::isfinite(now_.next) ? force : std::numeric_limits<double>::infinity();
}

HeldContact::Mean HeldContact::mean(double start, double end) const {
  const double way = end - start, factor = law_.damping_factor(way / size_);
  double force = 0.0, by_end = 0.0;
  // Where the difference quotient is rounding, the middle is as good.
  if (std::abs(way) <= 1e-6 * (std::abs(end) + std::abs(start))) {
    const double middle = (start + end) / 2;
    force = law_.elastic(middle);
    if (middle > 0.0) by_end = law_.slopes(middle, 0.0).force_by_depth / 2;
  } else {
    force = (law_.energy(end) - law_.energy(start)) / way;
    by_end = (law_.elastic(end) - force) / way;
  }
  const double damping = factor > 0.0 && way != 0.0 ? (factor - 1.0) / way * force : 0.0;  // C χ/H
  return {factor * force, factor * by_end + damping};
}

}  // namespace spring
