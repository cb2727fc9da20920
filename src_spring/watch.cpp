#include "watch.hpp"

namespace spring {

Watch::Watch(const Series& distance) {
  const auto leading = [&distance](std::size_t from) {
    while (from < distance.size() && distance[from] == 0.0) ++from;
    return from;
  };
  // A distance that starts at 0 and falls at once is left as it is: its fall is found at the start.
  const std::size_t k = leading(0), j = leading(1);
  if (direction(distance) > 0.0) distance_ = {static_cast<int>(k), distance[k]};
  if (j < distance.size()) rate_ = {static_cast<int>(j - 1), static_cast<double>(j) * distance[j]};
}

double Watch::direction(const Series& distance) {
  for (const double c : distance)
    if (c != 0.0) return c > 0.0 ? 1.0 : -1.0;
  return 0.0;
}

double Watch::Scale::divided(double value, double s) const {
  if (power == 0) return value;
  if (s <= 0.0) return leading;
  for (int k = 0; k < power; ++k) value /= s;
  return value;
}

}  // namespace spring
