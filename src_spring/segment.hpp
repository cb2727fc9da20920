// One smooth part of a step, between two events, as an implicit system for IDA in scaled time s = τ/H: what a flight
// (flight.hpp) and a rest on the foundation (seated.hpp) have in common.
//
// [contact]: y − u_tip changes sign. A rate that rises through 0 marks a minimum of the gap, so that a gap that dips
// below 0 between two internal steps is noticed. See watch.hpp for gaps that start at 0.
#pragma once

#include <vector>

#include "ida_solver.hpp"
#include "motion.hpp"
#include "taylor.hpp"
#include "watch.hpp"

namespace spring {

/// Where a segment starts, and what may be known better than by subtraction.
struct Start {
  double y, z;
  Loads loads;
  double size;      ///< H [s]
  double gap;       ///< y − φ, exactly 0 after a stop event
  double depth;     ///< y − u_tip, exactly 0 after a contact event
  bool released;    ///< from the stop, N = 0: ÿ = 0 by definition
  long most_steps;  ///< of IDA
};

class Segment : public ImplicitSystem {
 public:
  enum class Event { none, stop, release, contact };

  /// @throws IdaError; s reached is solver().s()
  virtual Event run(const Start& start) = 0;

  /// At the end of run(): motion, ∫y and ∫∫y since the start, what was dissipated [J], ∫N of the foundation [N·s].
  struct Reached {
    double y, z, integral, integral_2, dissipated, impulse;
  };
  const Reached& reached() const { return reached_; }
  virtual double displacement() const = 0;                      ///< y, also where run() failed
  double elapsed() const { return solver_.s() * start_.size; }  ///< τ
  const IdaSolver& solver() const { return solver_; }

 protected:
  /// `crossings` of the event functions that follow those of the contact.
  Segment(const Motion& motion, const Parameters& parameters, int unknowns, const std::vector<Crossing>& crossings);

  /// Takes over where the segment starts.
  void begin(const Start& start);
  /// Whether the top touches the tip, and the depth's Taylor coefficients.
  void meet(bool touching, const Series& depth);
  double contact_depth(double rise, double s) const;
  double contact_rate(double slope, double s) const { return slope - rate(loads_.tip, s); }  ///< both d/ds
  void contact_events(double rise, double slope, double s, double* g) const;

  const Motion& motion_;
  const Parameters& parameters_;
  const int contact_;  ///< its event functions, −1 if there are none. A distance is followed by its rate
  const int own_;      ///< the first of the other ones
  IdaSolver solver_;
  Start start_{};
  Loads loads_;  ///< over s
  bool touching_ = false;
  Reached reached_{};

 private:
  double contact_sign_ = 1.0;
  Watch contact_watch_;
};

}  // namespace spring
