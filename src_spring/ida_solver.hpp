// SUNDIALS IDA for a small dense implicit system F(s, Y, Y') = 0 on s ∈ [0, 1] (variable-order BDF, order ≤ 5).
// Memory is allocated once; every start() re-initialises IDA completely, so the result depends on the arguments alone.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace spring {

/// F(s, Y, Y') = 0 with its Jacobian J = ∂F/∂Y + c ∂F/∂Y' and event functions g.
class ImplicitSystem {
 public:
  virtual ~ImplicitSystem() = default;
  /// @return false if F cannot be evaluated here (IDA then tries a smaller step)
  virtual bool residual(double s, const double* Y, const double* Yp, double* F) const noexcept = 0;
  /// Column-major, n × n, zero on entry.
  virtual void jacobian(double s, double c, const double* Y, const double* Yp, double* J) const noexcept = 0;
  virtual void events(double s, const double* Y, double* g) const noexcept = 0;
};

/// IDA gave up; the message names the flag.
class IdaError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The steps allowed did not suffice.
class TooMuchWork : public IdaError {
 public:
  TooMuchWork() : IdaError("too many internal steps") {}
};

/// Which sign changes of an event function count.
enum class Crossing { falling = -1, rising = 1 };

class IdaSolver {
 public:
  /// `crossings`: one entry per event function.
  IdaSolver(int unknowns, const std::vector<Crossing>& crossings);
  ~IdaSolver();
  IdaSolver(const IdaSolver&) = delete;
  IdaSolver& operator=(const IdaSolver&) = delete;

  /// Fill in before start(): consistent Y(0), Y'(0) and the absolute tolerance of each unknown.
  double* initial_value();
  double* initial_derivative();
  double* absolute_tolerance();

  /// Start afresh at s = 0, for at most `most_steps` internal steps. `system` must stay alive until the last advance().
  void start(const ImplicitSystem& system, double relative_tolerance, double first_step, long most_steps);

  enum class Outcome { finished, event };
  /// Go on to s = 1 or to the next event, whichever comes first. @throws IdaError
  Outcome advance();

  double s() const;                ///< reached
  const double* value() const;     ///< Y(s)
  bool occurred(int event) const;  ///< after Outcome::event
  /// After Outcome::event, for a distance among the event functions, followed by its rate: the distance passed 0, or is
  /// found below 0 at its minimum; s() and value() are then moved back to where it passed 0.
  bool fell(int distance);
  long steps() const;  ///< internal steps since start()

 private:
  double event_value(int event) const;
  double last_step_start() const;
  void interpolate(double s);

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace spring
