#include "held_contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "../fmus/common/text.hpp"
#include "flat.hpp"

namespace spring {

HeldContact::HeldContact(const Compliance& law, double mass, double size, const std::array<double, 2>& response)
    : law_(law), yielding_(size * size / 2 / mass), size_(size), response_(response) {
  if (!(response[0] > 0.0)) {
    throw std::invalid_argument(
        "spring: tip_response = " + common::number(response[0]) +
        ": must be > 0 where communication_step > 0; it is an output of the beam with the same one");
  }
}

void HeldContact::begin(const TipMessage& seen, double y, const Top& top) {
  TipMessage& first = now_.first;
  const bool nothing = seen.displacement == 0.0 && seen.velocity == 0.0;
  const bool held_back = nothing && (first.displacement != 0.0 || first.velocity != 0.0);
  if (!held_back) first = seen;
  now_.tip = first.displacement;
  now_.depth = y - now_.tip;
  const double free = now_.tip + size_ * first.velocity;
  if (held_back) {
    send(0.0, free);
  } else {
    choose(y, free, top);
  }
}

void HeldContact::advance(const TipMessage& seen, double y, const Top& top) {
  const TipMessage& from = started() ? seen : now_.first;
  if (now_.steps == 2.0) compare(seen);  // before, the first step's mean velocity was a guess
  now_.steps = std::min(now_.steps + 1.0, 2.0);
  now_.tip = now_.next;
  const double depth = y - now_.tip;
  if (law_.damped())
    now_.dissipated += now_.force * (depth - now_.depth) - (law_.energy(depth) - law_.energy(now_.depth));
  now_.depth = depth;
  choose(y, from.displacement + 2.0 * size_ * from.velocity + now_.force * response_[1], top);
}

void HeldContact::compare(const TipMessage& seen) {
  constexpr double noticeable = 0.05;  // of the way in a step
  reach_ = std::max({reach_, size_ * std::abs(seen.velocity), response_[0] * now_.force});
  const double off = std::abs(seen.displacement - now_.tip);
  if (off <= noticeable * reach_) return;
  ++missed_;
  farthest_ = std::max(farthest_, off);
}

void HeldContact::choose(double y, double free, const Top& top) {
  const double start = y - now_.tip, yielding = response_[0] + yielding_;
  double low = 0.0, high = std::numeric_limits<double>::infinity();
  double force = std::isfinite(now_.force) ? now_.force : 0.0;
  // The top answers almost like a free mass, then two or three trials do; an impact on the foundation takes more.
  for (int trial = 0; trial < 60; ++trial) {
    const double reached = top(force);
    if (!std::isfinite(reached)) break;
    const double at_rest = reached + yielding_ * force - free;
    const double wanted = held(start, at_rest - yielding * force);
    if (!std::isfinite(wanted)) {
      force = wanted;
      break;
    }
    if (std::abs(wanted - force) <= 1e-13 * force) break;
    (wanted > force ? low : high) = force;
    double next = root(start, at_rest, yielding);
    if (!(low < next && next < high) && std::isfinite(high)) next = low + (high - low) / 2;
    if (next == force) break;
    force = next;
    if (!std::isfinite(force)) break;
  }
  send(force, free);
}

void HeldContact::send(double force, double free) {
  now_.next = free + response_[0] * force;
  now_.force = std::isfinite(now_.next) ? force : std::numeric_limits<double>::infinity();
}

/// C with C = held(start, free − yielding·C). The mean falls with C: there is one, between 0 and what no yielding
/// gives.
double HeldContact::root(double start, double free, double yielding) const {
  double low = 0.0, high = held(start, free);
  while (high - low > 4.0 * std::numeric_limits<double>::epsilon() * high) {
    const double middle = low + (high - low) / 2;
    if (middle <= low || middle >= high) break;  // neighbouring denormal numbers, or not finite
    (held(start, free - yielding * middle) > middle ? low : high) = middle;
  }
  return high;
}

double HeldContact::held(double start, double end) const {
  const double factor = law_.damping_factor((end - start) / size_);
  // Where the difference quotient is rounding, the middle is as good.
  if (std::abs(end - start) <= 1e-6 * (std::abs(end) + std::abs(start)))
    return factor * law_.elastic((start + end) / 2);
  return factor * ((law_.energy(end) - law_.energy(start)) / (end - start));
}

void HeldContact::restore(const State& state) {
  auto numbers = flat(state);
  // The force may be past all numbers, and then so is the tip's next place.
  if (!std::isfinite(state.force)) numbers[1] = numbers[2] = 0.0;
  for (const double value : numbers) {
    if (!std::isfinite(value)) {
      throw std::invalid_argument("spring: a saved state has numbers that are not finite");
    }
  }
  now_ = state;
}

}  // namespace spring
