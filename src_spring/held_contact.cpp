#include "held_contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "parameters.hpp"

namespace spring {

HeldContact::HeldContact(const Compliance& law, double mass, double size, const std::array<double, 2>& response)
    : law_(law), yielding_(size * size / 2 / mass), size_(size), response_(response) {
  const auto require = [](bool allowed, const char* name, double value, const char* what) {
    if (!allowed) throw std::invalid_argument(std::string("spring: ") + name + " = " + number(value) + what);
  };
  require(std::isfinite(size) && size > 0.0, "communication_step", size, ": must be > 0 and finite");
  require(std::isfinite(response[0]) && response[0] > 0.0, "tip_response", response[0],
          ": must be > 0 and finite where communication_step > 0; it is an output of the beam with the same one");
  require(std::isfinite(response[1]), "tip_response_2", response[1], ": must be finite");
}

void HeldContact::begin(const TipMessage& seen, double y, const Top& top) {
  const bool nothing = seen.displacement == 0.0 && seen.velocity == 0.0;
  const bool held_back = nothing && (first_.displacement != 0.0 || first_.velocity != 0.0);
  if (!held_back) first_ = seen;
  tip_ = first_.displacement;
  const double free = tip_ + size_ * first_.velocity;
  if (held_back) {
    send(0.0, free);
  } else {
    choose(y, free, top);
  }
}

void HeldContact::advance(const TipMessage& seen, double y, const Top& top) {
  const TipMessage& from = started() ? seen : first_;
  if (steps_ == 2.0) compare(seen);  // before, the first step's mean velocity was a guess
  steps_ = std::min(steps_ + 1.0, 2.0);
  tip_ = next_;
  choose(y, from.displacement + 2.0 * size_ * from.velocity + force_ * response_[1], top);
}

void HeldContact::compare(const TipMessage& seen) {
  constexpr double noticeable = 0.05;  // of the way in a step
  reach_ = std::max({reach_, size_ * std::abs(seen.velocity), response_[0] * force_});
  const double off = std::abs(seen.displacement - tip_);
  if (off <= noticeable * reach_) return;
  ++missed_;
  farthest_ = std::max(farthest_, off);
}

void HeldContact::choose(double y, double free, const Top& top) {
  const double start = y - tip_, yielding = response_[0] + yielding_;
  double low = 0.0, high = std::numeric_limits<double>::infinity();
  double force = std::isfinite(force_) ? force_ : 0.0;
  // The top answers almost like a free mass, then two or three trials do; an impact on the foundation takes more.
  for (int trial = 0; trial < 60; ++trial) {
    const double reached = top(force);
    if (!std::isfinite(reached)) break;
    const double at_rest = reached + yielding_ * force - free;
    const double wanted = mean(start, at_rest - yielding * force);
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
  next_ = free + response_[0] * force;
  force_ = std::isfinite(next_) ? force : std::numeric_limits<double>::infinity();
}

/// C with C = mean(start, free − yielding·C). The mean falls with C: there is one, between 0 and what no yielding
/// gives.
double HeldContact::root(double start, double free, double yielding) const {
  double low = 0.0, high = mean(start, free);
  while (high - low > 4.0 * std::numeric_limits<double>::epsilon() * high) {
    const double middle = low + (high - low) / 2;
    if (middle <= low || middle >= high) break;  // neighbouring denormal numbers, or not finite
    (mean(start, free - yielding * middle) > middle ? low : high) = middle;
  }
  return high;
}

double HeldContact::mean(double start, double end) const {
  // Where the difference quotient is rounding, the middle is as good.
  if (std::abs(end - start) <= 1e-6 * (std::abs(end) + std::abs(start))) return law_.force((start + end) / 2);
  return (law_.energy(end) - law_.energy(start)) / (end - start);
}

std::array<double, HeldContact::state_length> HeldContact::state() const {
  return {tip_, next_, force_, first_.displacement, first_.velocity, steps_};
}

void HeldContact::restore(const double* state) {
  const auto finite = [state](int i) { return std::isfinite(state[i]); };
  // The force (2) may be past all numbers, and then so is the tip's next place (1).
  if (!finite(0) || !finite(3) || !finite(4) || !finite(5) || (finite(2) && !finite(1))) {
    throw std::invalid_argument("spring: a saved state has numbers that are not finite");
  }
  for (double* member : {&tip_, &next_, &force_, &first_.displacement, &first_.velocity, &steps_}) *member = *state++;
}

}  // namespace spring
