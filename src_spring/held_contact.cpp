#include "held_contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace spring {

void HeldContact::see(double displacement, double velocity) {
  u_ = displacement;
  v_ = velocity;
  if (size_ > 0.0) free_ = (v_ - v_before_) / size_ - force_before_ / tip_mass_;
}

void HeldContact::choose(double y, double z, double acceleration, bool held) {
  const double h = size_;
  const double depth = y - u_;
  if (h == 0.0) {
    force_ = law_.force(depth);
    return;
  }
  const double spring = held ? 0.0 : h * z + h * h / 2 * acceleration;
  const double change = spring - h * v_ - h * h / 2 * free_;
  const double yielding = h * h / 2 * (1.0 / tip_mass_ + (held ? 0.0 : 1.0 / mass_));
  const auto mean = [&](double force) {
    const double after = depth + change - yielding * force;
    // Where the difference quotient is rounding, the middle is as good.
    if (std::abs(after - depth) <= 1e-6 * (std::abs(after) + std::abs(depth))) {
      return law_.force((after + depth) / 2);
    }
    return (law_.energy(after) - law_.energy(depth)) / (after - depth);
  };
  // `mean` falls with the force: one root, between 0 and what no yielding would give.
  double low = 0.0, high = mean(0.0);
  while (high - low > 4.0 * std::numeric_limits<double>::epsilon() * high) {
    const double middle = (low + high) / 2;
    if (middle <= low || middle >= high) break;  // neighbouring denormal numbers
    (mean(middle) > middle ? low : high) = middle;
  }
  force_ = high;
}

void HeldContact::advance(double size) {
  v_before_ = v_;
  force_before_ = force_;
  size_ = size;
  const double acceleration = free_ + force_ / tip_mass_;
  u_ += size * v_ + size * size / 2 * acceleration;
  v_ += size * acceleration;
}

void HeldContact::restore(const double* state) {
  for (double* member : {&u_, &v_, &free_, &force_, &size_, &v_before_, &force_before_}) *member = *state++;
}

}  // namespace spring
