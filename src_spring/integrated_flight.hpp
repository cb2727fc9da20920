// Free motion of the spring's top as an implicit system for IDA, where no Taylor series serves (flight.hpp).
//
// In scaled time s = τ/H, with q = y − y(0), p = H ẏ, A = ∫₀ˢ q, B = ∫₀ˢ A and the dissipated energy e:
//     F = ( q' − p,   p' − H² ÿ(y, ẏ, τ),   A' − q,   B' − A,   e' − H (α_s ẏ² + d) ) = 0,
// d the power that the contact dissipates. q, p, A, B are lengths; ∫y = H (y(0) s + A), ∫∫y = H² (y(0) s²/2 + B). All
// are under error control.
#pragma once

#include "equation_of_motion.hpp"
#include "events.hpp"
#include "ida_solver.hpp"

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

/// Where a flight has come to.
struct FlightEnd {
  Event event;
  double elapsed;               ///< since the start [s]
  bool at_end;                  ///< of all of Start::size
  double y, z;                  ///< [m, m/s]
  double integral, integral_2;  ///< ∫y dτ, ∫∫y dτ dτ since the start
  double dissipated;            ///< [J]
  long steps;                   ///< internal ones
};

class IntegratedFlight final : public ImplicitSystem {
 public:
  IntegratedFlight(const EquationOfMotion& equation, const Parameters& parameters);

  /// Flies on to an event or to the end; `touching` the tip, or not. `end` is where it came, also if it fails.
  /// @throws SolverError
  void run(const Start& start, bool touching, FlightEnd& end);

  bool residual(double s, const double* Y, const double* Yp, double* F) const noexcept override;
  void jacobian(double s, double c, const double* Y, const double* Yp, double* J) const noexcept override;

 private:
  void launch();
  Occurrence event_of_last_step() const;
  FlightEnd here(Event event) const;
  double depth(double q, double s) const;       ///< y − u_tip [m]
  double depth_rate(double p, double s) const;  ///< [m/s]

  const EquationOfMotion& equation_;
  const Parameters& parameters_;
  IdaSolver solver_;
  Start start_{};
  Loads loads_{};  ///< over s
  bool touching_ = false;
};

}  // namespace spring
