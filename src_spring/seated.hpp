// The spring's top resting on the foundation over one segment of a step, as a differential-algebraic system for IDA.
//     F = ( y − φ,   ẏ,   N + F(τ) − α_s ẏ − k1 y − k2 y³ − C,   P' − H N,   e' − H d ) = 0,        s = τ/H,
// index 1: the constraint is posed for position and velocity, N is the algebraic unknown of the force balance,
// P = ∫N dτ, e what the contact dissipates, d its power. N and P are counted from the quadratic N_R(τ) = N₀ + Ṅ₀τ +
// N̈₀τ²/2 at the segment's start.
//
// Events: [release] N falls below 0 (its minima are watched too); [contact] see segment.hpp.
#pragma once

#include "segment.hpp"

namespace spring {

class Seated final : public Segment {
 public:
  Seated(const Motion& motion, const Parameters& parameters);

  /// N and its rates at the start; the top stays where the first that is not 0 is positive (or all are 0).
  static bool holds(const Polynomial& holding_force);

  /// @pre holds(), y = φ, z = 0
  Event run(const Start& start) override;
  double displacement() const override { return parameters_.stop_position; }

  bool residual(double s, const double* Y, const double* Yp, double* F) const noexcept override;
  void jacobian(double s, double c, const double* Y, const double* Yp, double* J) const noexcept override;
  void events(double s, const double* Y, double* g) const noexcept override;

 private:
  void prepare();

  Polynomial N_;  ///< over s
  Watch release_watch_;
};

}  // namespace spring
