#include "watch.hpp"

namespace spring {

Watch::Watch(const std::array<double, 5>& derivatives) {
  const auto scale = [&derivatives](std::size_t first) {
    double factorial = 1.0;
    for (std::size_t k = 0; first + k < derivatives.size(); ++k) {
      if (k > 0) factorial *= static_cast<double>(k);
      if (derivatives[first + k] != 0.0) return Scale{static_cast<int>(k), derivatives[first + k] / factorial};
    }
    return Scale{};
  };
  // A distance that starts at 0 and falls at once is left as it is: its fall is found at the start.
  if (direction(derivatives) > 0.0) distance_ = scale(0);
  rate_ = scale(1);
}

double Watch::direction(const std::array<double, 5>& derivatives) {
  for (double d : derivatives)
    if (d != 0.0) return d > 0.0 ? 1.0 : -1.0;
  return 0.0;
}

double Watch::Scale::divided(double value, double t) const {
  if (power == 0) return value;
  if (t <= 0.0) return leading;
  for (int k = 0; k < power; ++k) value /= t;
  return value;
}

}  // namespace spring
