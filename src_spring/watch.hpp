// A distance whose fall through 0 is an event, and its rate, made fit for root finding.
//
// Events start segments, so a distance (or rate) is often exactly 0 at τ = 0, and IDA's first interpolants are too
// coarse for what it does right after. Such a quantity is divided by its leading power of τ: no root at the start, the
// same sign after it.
#pragma once

#include <array>

namespace spring {

class Watch {
 public:
  Watch() = default;
  /// `derivatives`: the distance, ≥ 0, and its time derivatives at τ = 0.
  explicit Watch(const std::array<double, 5>& derivatives);

  /// Sign of the first derivative that is not 0: where the distance goes from τ = 0 on.
  static double direction(const std::array<double, 5>& derivatives);

  double distance(double value, double t) const { return distance_.divided(value, t); }
  double rate(double value, double t) const { return rate_.divided(value, t); }

 private:
  struct Scale {
    int power = 0;
    double leading = 1.0;  ///< the quotient at τ = 0, where power > 0
    double divided(double value, double t) const;
  };
  Scale distance_, rate_;
};

}  // namespace spring
