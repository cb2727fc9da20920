// Free motion of the spring's top over one segment of a step, as an implicit system for IDA.
//
// With R the Taylor polynomial of the start (taylor.hpp), scaled time s = τ/H, w = ẏ − Ṙ:
//     q = y − R,   p = H w,   A = ∫₀ˢ q,   B = ∫₀ˢ A,   e = D − ∫ (α_s Ṙ² + d_R) dτ
//     F = ( q' − p,   p' − H²[ÿ(y, ẏ, τ) − R̈],   A' − q,   B' − A,   e' − H [α_s w (2Ṙ + w) + d − d_R] ) = 0,
// D the dissipated energy, d what the contact dissipates and d_R its Taylor polynomial. ÿ − R̈ is evaluated without
// cancellation (motion.hpp). q, p, A, B are lengths; ∫y = ∫R + H A and ∫∫y = ∫∫R + H² B. All unknowns are under error
// control, see tolerances in flight.cpp.
//
// Events: [hilltop] |y| is past the hilltop and nothing brings it back, neither a contact nor the loads; [stop] y − φ
// falls to 0; [contact] y − u_tip changes sign. A rate (ẏ, ẏ − u̇_tip) that rises through 0 marks a minimum of the gap,
// so that a gap that dips below 0 between two internal steps is noticed. See watch.hpp for gaps that start at 0.
#pragma once

#include <cmath>
#include <vector>

#include "ida_solver.hpp"
#include "motion.hpp"
#include "taylor.hpp"
#include "watch.hpp"

namespace spring {

/// Which laws an object has; fixes the event functions.
struct Laws {
  double hilltop;  ///< infinity: none
  bool stop;
  double stop_position;
  bool compliance;
  double relative_tolerance, absolute_tolerance;

  /// How far the top is from ±height [m]; a stop at the lower hilltop or above keeps it from the lower one.
  double to(double height, double y) const { return height - (stop && stop_position >= -hilltop ? y : std::abs(y)); }
};

/// Where a segment starts, and what may be known better than by subtraction.
struct FlightStart {
  double y, z;
  Loads loads;
  double size;      ///< H [s]
  double gap;       ///< y − φ, exactly 0 after a stop event
  double depth;     ///< y − u_tip, exactly 0 after a contact event
  bool released;    ///< from the stop, N = 0: ÿ = 0 by definition
  long most_steps;  ///< of IDA
};

class Flight final : public ImplicitSystem {
 public:
  enum class Event { none, hilltop, stop, contact };

  Flight(const Motion& motion, const Laws& laws);

  /// @throws IdaError; s reached is solver().s()
  Event run(const FlightStart& start);

  // At the end of run():
  double elapsed() const;  ///< τ
  double displacement() const { return y_; }
  double velocity() const { return z_; }
  double integral() const { return integral_; }
  double integral_2() const { return integral_2_; }
  double dissipated() const { return dissipated_; }
  const IdaSolver& solver() const { return solver_; }

  bool residual(double s, const double* Y, const double* Yp, double* F) const noexcept override;
  void jacobian(double s, double c, const double* Y, const double* Yp, double* J) const noexcept override;
  void events(double s, const double* Y, double* g) const noexcept override;

 private:
  void prepare(const FlightStart& start);
  bool escapes() const;  ///< once past `height_`
  double contact_depth(double rise, double s) const;
  double contact_rate(double y_rate, double s) const { return y_rate - rate(loads_.tip, s); }  ///< both d/ds
  void finish();

  const Motion& motion_;
  const Laws laws_;
  // Event functions: where each begins, −1 if there is none. A distance is followed by its rate.
  std::vector<Crossing> crossings_;
  const int hilltop_, stop_, contact_;
  IdaSolver solver_;
  // The segment.
  FlightStart start_{};
  Loads loads_;  ///< over s
  Taylor R_;
  Motion::Remainder remainder_;
  Series contact_taylor_{}, dissipation_taylor_{};  ///< contact force and its loss d_R, as far as R accounts for them
  int contact_order_ = -1;                          ///< of these
  bool touching_ = false, held_ = false;
  double height_ = 0.0;  ///< |y| from where it may escape
  double contact_sign_ = 1.0;
  Watch stop_watch_, contact_watch_;
  double relative_ = 0.0, h0_ = 1.0;
  double y_ = 0.0, z_ = 0.0, integral_ = 0.0, integral_2_ = 0.0, dissipated_ = 0.0;
};

}  // namespace spring
