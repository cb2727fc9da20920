// Free motion of the spring's top between two events, as an implicit system for IDA.
//
// With R the Taylor polynomial of the start (taylor.hpp), scaled time s = τ/H, w = ẏ − Ṙ:
//     q = y − R,   p = H w,   A = ∫₀ˢ q,   B = ∫₀ˢ A,   e = D − ∫ (α_s Ṙ² + d_R) dτ
//     F = ( q' − p,   p' − H²[ÿ(y, ẏ, τ) − R̈],   A' − q,   B' − A,   e' − H [α_s w (2Ṙ + w) + d − d_R] ) = 0,
// D the dissipated energy, d what the contact dissipates and d_R its Taylor polynomial. ÿ − R̈ is evaluated without
// cancellation (motion.hpp). q, p, A, B are lengths; ∫y = ∫R + H A and ∫∫y = ∫∫R + H² B. All unknowns are under error
// control, see Tolerances in flight.cpp.
//
// Events: [stop] y − φ falls to 0; [contact] y − u_tip changes sign.
#pragma once

#include "ida_solver.hpp"
#include "motion.hpp"
#include "taylor.hpp"

namespace spring {

/// Where a flight starts, and what may be known better than by subtraction.
struct Start {
  double y, z;
  Loads loads;
  double size;      ///< at most [s]
  double gap;       ///< y − φ, exactly 0 after a stop event
  double depth;     ///< y − u_tip, exactly 0 after a contact event
  bool released;    ///< from the stop, N = 0: ÿ = 0 by definition
  long most_steps;  ///< of IDA
};

class Flight final : public ImplicitSystem {
 public:
  Flight(const Motion& motion, const Parameters& parameters);

  enum class Event { none = -1, stop, contact };
  /// At the end of run(): motion, ∫y and ∫∫y since the start, what was dissipated [J].
  struct Reached {
    Event event;
    double y, z, integral, integral_2, dissipated;
  };
  /// Flies on to an event, to the end, or as far as one Taylor polynomial serves.
  /// @throws IdaError; elapsed(), displacement() and steps() tell how far it came
  Reached run(const Start& start);
  double elapsed() const { return solver_.s() * size_; }  ///< τ
  bool at_end() const { return solver_.s() == 1.0 && size_ == start_.size; }
  double displacement() const { return start_.y + (R_.rise(solver_.s()) + solver_.value()[0]); }  ///< y
  long steps() const { return solver_.steps(); }                                                  ///< IDA's

  bool residual(double s, const double* Y, const double* Yp, double* F) const noexcept override;
  void jacobian(double s, double c, const double* Y, const double* Yp, double* J) const noexcept override;
  Distance distance(int which, double s, const double* Y) const noexcept override;

 private:
  /// How fast and how far the motion goes.
  struct Pace {
    double oscillation, rate;        ///< bounds of the rates with which it changes [1/s]
    double span;                     ///< H or what the rate allows [s]
    double displacement, velocity;   ///< what y and z are, or become over the span
    double force, lost, depth_rate;  ///< of the contact at the start [N, W, m/s]
    bool smooth;                     ///< whether the contact force has a Taylor polynomial of any order
  };
  struct Tolerances {
    double share, y, z, e;  ///< of the relative tolerance; absolute
  };
  /// R's order and the first step, 2^−halvings.
  struct Opening {
    int order, halvings;
  };
  void begin(double size);
  Expansion expand();
  Pace pace(const Expansion& motion) const;
  Tolerances tolerances(const Pace& pace) const;
  Opening open(Expansion& motion, const Pace& pace, const Tolerances& tolerances) const;
  bool within_reach(const Expansion& motion) const;
  void launch(const Expansion& motion, const Pace& pace, const Tolerances& tolerances, const Opening& opening);

  double contact_depth(double rise, double s) const;
  double contact_rate(double slope, double s) const { return slope - spring::rate(loads_.tip, s); }  ///< both d/ds

  const Motion& motion_;
  const Parameters& parameters_;
  const std::array<bool, distances> distances_;  ///< which there are
  const double part_;                            ///< longest H × rate of an oscillation
  IdaSolver solver_;
  Start start_{};
  double size_ = 0.0;  ///< H
  Loads loads_;        ///< over s
  bool touching_ = false;
  Taylor R_;
  Motion::Remainder remainder_;
  Series contact_taylor_{}, dissipation_taylor_{};  ///< contact force and its loss d_R, as far as R accounts for them
  int contact_order_ = -1;                          ///< of these
};

}  // namespace spring
