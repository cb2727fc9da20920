// Where a distance that is a polynomial of s ∈ [0, 1] first falls below 0. The places where a polynomial is 0 lie
// between those where its derivative is, and so on up to a derivative that has none: no fall is missed, however many
// turns there are.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>

#include "parameters.hpp"
#include "taylor.hpp"

namespace spring {

/// The last place from `low` on, to `resolution`, before past() holds, which it does at `high`.
template <class Past>
double last_before(double low, double high, double resolution, const Past& past) {
  while (high - low > resolution) {
    const double middle = low + (high - low) / 2;
    (past(middle) ? high : low) = middle;
  }
  return low;
}

/// One rung of the ladder: calls found(place, now_negative) for each change of what is `negative` between `low` and the
/// first of the ends, and between these, in which it changes once at most; until it returns true.
template <class Ends, class Negative, class Found>
void changes_between(double low, const Ends& ends, const Negative& negative, const Found& found) {
  bool before = negative(low);
  for (const double high : ends) {
    const bool after = negative(high);
    const auto past = [&](double s) { return negative(s) == after; };
    if (after != before && found(last_before(low, high, 2.0 * std::numeric_limits<double>::epsilon(), past), after))
      return;
    before = after;
    low = high;
  }
}

/// Ascending places in (0, 1].
struct Places {
  std::array<double, max_order + 2> at{};
  std::size_t count = 0;
  void add(double place) { at[count++] = place; }
  const double* begin() const { return at.data(); }
  const double* end() const { return at.data() + count; }
};
/// Where Σ c_k sᵏ, k ≤ degree, changes its sign, to rounding.
Places sign_changes(const Series& c, int degree);

/// The last place, to rounding, before Σ c_k sᵏ, k ≤ degree, is below 0 for the first time; nothing if it never is.
std::optional<double> first_fall(const Series& c, int degree);

/// How a part of a step ends: at the stop, where contact with the tip begins or ends, where a seated top is released.
enum class Event { none, stop, contact, release };
struct Occurrence {
  Event event;
  double s;  ///< 1 for none
};
/// The first of what may happen: `gap`, y − φ, falls below 0 where there is a stop, or `depth`, y − u_tip, leaves its
/// side of 0, that of `touching` or the other one, where there is a law.
Occurrence first_event(const Parameters& parameters, const Series& gap, Series depth, bool touching, int degree);

}  // namespace spring
