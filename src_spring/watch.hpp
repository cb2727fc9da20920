// A distance whose fall through 0 is an event, made fit for root finding.
#pragma once

#include <array>

namespace spring {

/// A distance that is ≥ 0 at the segment's start; its sign change is an event.
class Watch {
 public:
  Watch() = default;
  /// `derivatives`: the distance and its rates at τ = 0. A start at 0 must not move below.
  explicit Watch(const std::array<double, 5>& derivatives);

  /// Sign of the first derivative that is not 0: where the distance goes from τ = 0 on.
  static double direction(const std::array<double, 5>& derivatives);

  /// Same sign as the distance for τ > 0, and > 0 at τ = 0.
  double scaled(double distance, double t) const;

 private:
  int power_ = 0;
  double leading_ = 1.0;
};

}  // namespace spring
