// SUNDIALS IDA for a small dense implicit system F(s, Y, Y') = 0 on s ∈ [0, 1] (variable-order BDF, order ≤ 5).
// Memory is allocated once; every start() re-initialises IDA completely, so the result depends on the arguments alone.
#pragma once

#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>

#include <memory>
#include <stdexcept>
#include <type_traits>

#include "fall.hpp"

namespace spring {

inline constexpr int distances = 2;  ///< of a system, at most: their falls through 0 are events

/// F(s, Y, Y') = 0 with its Jacobian J = ∂F/∂Y + c ∂F/∂Y' and distances.
class ImplicitSystem {
 public:
  virtual ~ImplicitSystem() = default;
  /// @return false if F cannot be evaluated here (IDA then tries a smaller step)
  virtual bool residual(double s, const double* Y, const double* Yp, double* F) const noexcept = 0;
  /// Column-major, n × n, zero on entry.
  virtual void jacobian(double s, double c, const double* Y, const double* Yp, double* J) const noexcept = 0;
  /// With its rate d/ds; {1, 1} for one that is not there.
  virtual Distance distance(int which, double s, const double* Y) const noexcept = 0;
};

/// IDA gave up; the message names the flag.
class IdaError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class IdaSolver {
 public:
  explicit IdaSolver(int unknowns);
  IdaSolver(const IdaSolver&) = delete;  // IDA knows where this is
  IdaSolver& operator=(const IdaSolver&) = delete;

  /// Fill in before start(): consistent Y(0), Y'(0) and the absolute tolerance of each unknown.
  double* initial_value() { return N_VGetArrayPointer(Y0_.get()); }
  double* initial_derivative() { return N_VGetArrayPointer(Yp0_.get()); }
  double* absolute_tolerance() { return N_VGetArrayPointer(tolerance_.get()); }

  /// Start afresh at s = 0, for at most `most_steps` internal steps. `system` must stay alive until the last advance().
  void start(const ImplicitSystem& system, double relative_tolerance, double first_step, long most_steps);

  /// Go on to s = 1, or to where a distance falls through 0, whichever comes first: also where it is below 0 for a part
  /// of an internal step only, about a minimum. Returns which; −1: none. @throws IdaError
  int advance();

  double s() const { return s_; }                                       ///< reached
  const double* value() const { return N_VGetArrayPointer(Y_.get()); }  ///< Y(s)
  long steps() const;                                                   ///< internal steps since start()

 private:
  template <class Handle>
  using Owned = std::shared_ptr<std::remove_pointer_t<Handle>>;
  using Vector = Owned<N_Vector>;

  static int residual(double s, N_Vector Y, N_Vector Yp, N_Vector F, void* solver);
  static int jacobian(double s, double c, N_Vector Y, N_Vector Yp, N_Vector F, SUNMatrix J, void* solver, N_Vector,
                      N_Vector, N_Vector);

  Vector new_vector() const;
  Distance distance(int which) const { return system_->distance(which, s_, value()); }
  void interpolate(double s);

  int n_;
  const ImplicitSystem* system_ = nullptr;
  double s_ = 0.0;
  long most_steps_ = 0;
  Owned<SUNContext> context_;  // outlives everything made in it
  Vector Y0_, Yp0_, tolerance_, Y_, Yp_;
  Owned<SUNMatrix> J_;
  Owned<SUNLinearSolver> linear_solver_;
  Owned<void*> ida_;
};

}  // namespace spring
