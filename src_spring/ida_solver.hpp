// SUNDIALS IDA for a small dense implicit system F(s, Y, Y') = 0 on s ∈ [0, 1] (variable-order BDF, order ≤ 5).
// Memory is allocated once; every start() re-initialises IDA completely, so the result depends on the arguments alone.
#pragma once

#include <ida/ida.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>

#include <memory>
#include <stdexcept>
#include <type_traits>

#include "taylor.hpp"

namespace spring {

/// F(s, Y, Y') = 0 with its Jacobian J = ∂F/∂Y + c ∂F/∂Y'.
class ImplicitSystem {
 public:
  virtual ~ImplicitSystem() = default;
  /// @return false if F cannot be evaluated here (IDA then tries a smaller step)
  virtual bool residual(double s, const double* Y, const double* Yp, double* F) const noexcept = 0;
  /// Column-major, n × n, zero on entry.
  virtual void jacobian(double s, double c, const double* Y, const double* Yp, double* J) const noexcept = 0;
};

/// No solution was found; the message says why, or names IDA's flag.
class SolverError : public std::runtime_error {
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

  /// Start afresh at s = 0, for at most `most_steps` internal steps. `system` must stay alive until the last step().
  void start(const ImplicitSystem& system, double relative_tolerance, double first_step, long most_steps);

  /// One internal step, at most to s = 1. @throws SolverError
  void step();
  double last_start() const { return last_start_; }      ///< where the last internal step began
  double last_size() const { return s_ - last_start_; }  ///< before interpolate()
  /// An unknown over the last internal step, as a power series in the part of it that is passed.
  struct Polynomial {
    Series coefficients;
    int degree;
  };
  Polynomial over_last_step(int unknown) const;
  /// Moves s and value() back into the last internal step.
  void interpolate(double s);

  double s() const { return s_; }                                       ///< reached
  const double* value() const { return N_VGetArrayPointer(Y_.get()); }  ///< Y(s)
  long steps() const;                                                   ///< internal steps since start()

 private:
  struct Destroy {
    void operator()(N_Vector made) const { N_VDestroy(made); }
    void operator()(SUNMatrix made) const { SUNMatDestroy(made); }
    void operator()(SUNLinearSolver made) const { SUNLinSolFree(made); }
    void operator()(SUNContext made) const { SUNContext_Free(&made); }
    void operator()(void* made) const { IDAFree(&made); }
  };
  template <class Handle>
  using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Destroy>;
  using Vector = Owned<N_Vector>;

  static int residual(double s, N_Vector Y, N_Vector Yp, N_Vector F, void* solver);
  static int jacobian(double s, double c, N_Vector Y, N_Vector Yp, N_Vector F, SUNMatrix J, void* solver, N_Vector,
                      N_Vector, N_Vector);

  Vector new_vector() const;
  int n_;
  const ImplicitSystem* system_ = nullptr;
  double s_ = 0.0, last_start_ = 0.0;
  long most_steps_ = 0;
  Owned<SUNContext> context_;  // outlives everything made in it
  Vector Y0_, Yp0_, tolerance_, Y_, Yp_, between_;
  Owned<SUNMatrix> J_;
  Owned<SUNLinearSolver> linear_solver_;
  Owned<void*> ida_;
};

}  // namespace spring
