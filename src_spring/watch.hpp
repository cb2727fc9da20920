// A distance whose fall through 0 is an event, and its rate, made fit for root finding.
//
// Events start segments, so a distance (or rate) is often exactly 0 at s = 0, and IDA's first interpolants are too
// coarse for what it does right after. Such a quantity is divided by its leading power of s: no root at the start, the
// same sign after it.
#pragma once

#include "taylor.hpp"

namespace spring {

class Watch {
 public:
  Watch() = default;
  /// The distance ≥ 0 near the start.
  explicit Watch(const Series& distance);

  /// Sign of the first coefficient that is not 0: where the distance goes from s = 0 on.
  static double direction(const Series& distance);

  double distance(double value, double s) const { return distance_.divided(value, s); }
  double rate(double value, double s) const { return rate_.divided(value, s); }  ///< d/ds

 private:
  struct Scale {
    int power = 0;
    double leading = 1.0;  ///< the quotient at s = 0, where power > 0
    double divided(double value, double s) const;
  };
  Scale distance_, rate_;
};

}  // namespace spring
