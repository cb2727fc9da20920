// Free motion of the spring's top between two events, y(s) over scaled time s = τ/H.
//
// Where the forces are analytic, the motion is its Taylor series, y = Σ c_k sᵏ, with H so small that what the series
// leaves out is below rounding at the default tolerance. Its integrals are exact, and so are its falls to the stop and
// to the tip (events.hpp). Two kinds of motion are left to IDA (integrated_flight.hpp): one in touch with the tip where
// the law's power has no series, and one over a span in which damping lets most of it die out.
#pragma once

#include "equation_of_motion.hpp"
#include "integrated_flight.hpp"

namespace spring {

class Flight {
 public:
  Flight(const EquationOfMotion& equation, const Parameters& parameters);

  /// Flies on to an event, to the end, or as far as one series serves.
  /// @throws SolverError; end() says how far it came
  const FlightEnd& run(const Start& start);
  const FlightEnd& end() const { return end_; }

 private:
  Expansion expand(double size);
  EquationOfMotion::Rates rates(const Expansion& motion) const;
  bool analytic(const Expansion& motion) const;
  void complete(Expansion& motion) const;
  FlightEnd follow(const Expansion& motion) const;
  double dissipated(const Expansion& motion, double s) const;

  const EquationOfMotion& equation_;
  const Parameters& parameters_;
  IntegratedFlight integrated_;
  Start start_{};
  FlightEnd end_{};
};

}  // namespace spring
