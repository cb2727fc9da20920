#include "watch.hpp"

namespace spring {

Watch::Watch(const std::array<double, 5>& derivatives) {
  double factorial = 1.0;
  for (int k = 0; k < 5; ++k) {
    if (k > 0) factorial *= k;
    const double d = derivatives[static_cast<std::size_t>(k)];
    if (d == 0.0) continue;
    if (d > 0.0) {
      power_ = k;
      leading_ = d / factorial;
    }
    return;
  }
}

double Watch::direction(const std::array<double, 5>& derivatives) {
  for (double d : derivatives)
    if (d != 0.0) return d > 0.0 ? 1.0 : -1.0;
  return 0.0;
}

double Watch::scaled(double distance, double t) const {
  if (power_ == 0) return distance;
  if (t <= 0.0) return leading_;
  for (int k = 0; k < power_; ++k) distance /= t;
  return distance;
}

}  // namespace spring
