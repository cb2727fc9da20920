// Where a distance falls through 0, also for a part of an interval only, about a minimum.
#pragma once

#include <optional>

namespace spring {

struct Distance {
  double value, rate;
};

/// The last place from `low` on, to `resolution`, before past() holds, which it does at `high`.
template <class Past>
double last_before(double low, double high, double resolution, const Past& past) {
  while (high - low > resolution) {
    const double middle = low + (high - low) / 2;
    (past(middle) ? high : low) = middle;
  }
  return low;
}

/// Where the distance `at(s)` falls through 0 between `low` and `high`: it is below 0 at `high`, where it is `end`, or
/// at its minimum, if the rate turns from `rate` ≤ 0 at `low` to one above 0.
template <class At>
std::optional<double> fall(double low, double high, double rate, const Distance& end, double resolution, const At& at) {
  double under = high;
  if (!(end.value < 0.0)) {
    if (!(rate <= 0.0 && end.rate > 0.0)) return {};
    under = last_before(low, high, resolution, [&](double s) { return at(s).rate > 0.0; });
    if (!(at(under).value < 0.0)) return {};
  }
  return last_before(low, under, resolution, [&](double s) { return at(s).value < 0.0; });
}

}  // namespace spring
