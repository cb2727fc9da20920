// The spring's top resting on the foundation over one segment of a step, as a differential-algebraic system for IDA.
//     F = ( y − φ,   ẏ,   N + F(τ) − α_s ẏ − k1 y − k2 y³ − C,   P' − H N,   e' − H d ) = 0,        s = τ/H,
// index 1: the constraint is posed for position and velocity, N is the algebraic unknown of the force balance,
// P = ∫N dτ, e what the contact dissipates, d its power. N and P are counted from the quadratic N_R(τ) = N₀ + Ṅ₀τ +
// N̈₀τ²/2 at the segment's start.
//
// Events: [release] N falls below 0 (its minima are watched too); [contact] y − u_tip changes sign.
#pragma once

#include "flight.hpp"

namespace spring {

/// Where a segment starts.
struct SeatedStart {
  Loads loads;
  double size;      ///< H [s]
  double depth;     ///< φ − u_tip, exactly 0 after a contact event
  long most_steps;  ///< of IDA
};

class Seated final : public ImplicitSystem {
 public:
  enum class Event { none, release, contact };

  Seated(const Motion& motion, const Laws& laws);

  /// N and its rates at the start; the top stays where the first that is not 0 is positive (or all are 0).
  static bool holds(const Quadratic& holding_force);

  /// @pre holds(). @throws IdaError
  Event run(const SeatedStart& start);

  double elapsed() const;                            ///< τ
  double impulse() const { return impulse_; }        ///< ∫N [N·s]
  double dissipated() const { return dissipated_; }  ///< by the contact [J]
  const IdaSolver& solver() const { return solver_; }

  bool residual(double s, const double* Y, const double* Yp, double* F) const noexcept override;
  void jacobian(double s, double c, const double* Y, const double* Yp, double* J) const noexcept override;
  void events(double s, const double* Y, double* g) const noexcept override;

 private:
  void prepare(const SeatedStart& start);
  double contact_depth(double eta, double t) const;
  double contact_rate(double zeta, double t) const { return zeta - spring::rate(start_.loads.tip, t); }

  const Motion& motion_;
  const Laws laws_;
  std::vector<Crossing> crossings_;
  const int release_, contact_;  ///< event functions, as in Flight
  IdaSolver solver_;
  SeatedStart start_{};
  Quadratic N_;
  bool touching_ = false;
  double contact_sign_ = 1.0;
  Watch release_watch_, contact_watch_;
  double relative_ = 0.0, h0_ = 1.0, impulse_ = 0.0, dissipated_ = 0.0;
};

}  // namespace spring
