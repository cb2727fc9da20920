#include "events.hpp"

#include <algorithm>
#include <cmath>

namespace spring {
namespace {

auto negative(const Series& c, int degree) {
  return [&c, degree](double s) { return sum_of_powers(c, s, 0, degree) < 0.0; };
}

/// The polynomial is monotone from 0 to the first, and from each to the next; the last is 1.
Places ends_of_monotone_stretches(const Series& c, int degree) {
  Series derivative{};
  for (int k = 1; k <= degree; ++k) derivative[static_cast<std::size_t>(k - 1)] = k * c[static_cast<std::size_t>(k)];
  Places ends = sign_changes(derivative, degree - 1);
  ends.add(1.0);
  return ends;
}

}  // namespace

Places sign_changes(const Series& c, int degree) {
  double others = 0.0;
  for (int k = 1; k <= degree; ++k) others += std::abs(c[static_cast<std::size_t>(k)]);
  Places changes;
  if (degree <= 0 || std::abs(c[0]) > others) return changes;
  changes_between(0.0, ends_of_monotone_stretches(c, degree), negative(c, degree), [&](double s, bool) {
    changes.add(s);
    return false;
  });
  return changes;
}

std::optional<double> first_fall(const Series& c, int degree) {
  double least = c[0];
  for (int k = 1; k <= degree; ++k) least += std::min(c[static_cast<std::size_t>(k)], 0.0);
  if (least >= 0.0) return {};
  if (c[0] < 0.0) return 0.0;
  std::optional<double> fall;
  changes_between(0.0, ends_of_monotone_stretches(c, degree), negative(c, degree), [&](double s, bool) {
    fall = s;
    return true;
  });
  return fall;
}

Occurrence first_event(const Parameters& parameters, const Series& gap, Series depth, bool touching, int degree) {
  Occurrence first{Event::none, 1.0};
  const auto look_at = [&](Event event, const Series& distance) {
    const auto fall = first_fall(distance, degree);
    if (fall && (first.event == Event::none || *fall < first.s)) first = {event, *fall};
  };
  if (parameters.stop_enabled) look_at(Event::stop, gap);
  if (!touching)
    for (double& c : depth) c = -c;
  if (parameters.compliant()) look_at(Event::contact, depth);
  return first;
}

}  // namespace spring
