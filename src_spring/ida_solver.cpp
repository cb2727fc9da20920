#include "ida_solver.hpp"

#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>

#ifndef SUN_COMM_NULL  // before SUNDIALS 7
#define SUN_COMM_NULL nullptr
#endif

namespace spring {
namespace {

static_assert(sizeof(sunrealtype) == sizeof(double), "SUNDIALS must be built in double precision");

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr int highest_order = 5;  ///< of its BDF
// Newton's remainder, relative to the tolerance: small, or it is noise in the error estimate (IDA's default, 0.33,
// costs more steps than it saves iterations).
constexpr double newton_share = 0.01;
constexpr int max_error_failures = 40;  ///< in one internal step: a first step that is far too long recovers

[[noreturn]] void fail(const char* what, int code) {
  std::unique_ptr<char, decltype(&std::free)> name(IDAGetReturnFlagName(code), &std::free);
  throw SolverError(std::string(what) + ": " + (name ? name.get() : "unknown flag"));
}

void check(int code, const char* what) {
  if (code < 0) fail(what, code);
}

/// @throws std::bad_alloc
template <class Handle>
Handle made(Handle handle) {
  if (handle == nullptr) throw std::bad_alloc();
  return handle;
}

}  // namespace

int IdaSolver::residual(double s, N_Vector Y, N_Vector Yp, N_Vector F, void* solver) {
  const ImplicitSystem& system = *static_cast<const IdaSolver*>(solver)->system_;
  const bool evaluated = system.residual(s, N_VGetArrayPointer(Y), N_VGetArrayPointer(Yp), N_VGetArrayPointer(F));
  return evaluated ? 0 : 1;
}

int IdaSolver::jacobian(double s, double c, N_Vector Y, N_Vector Yp, N_Vector, SUNMatrix J, void* solver, N_Vector,
                        N_Vector, N_Vector) {
  const ImplicitSystem& system = *static_cast<const IdaSolver*>(solver)->system_;
  system.jacobian(s, c, N_VGetArrayPointer(Y), N_VGetArrayPointer(Yp), SUNDenseMatrix_Data(J));
  return 0;
}

IdaSolver::Vector IdaSolver::new_vector() const {
  Vector vector(made(N_VNew_Serial(n_, context_.get())));
  N_VEnableFusedOps_Serial(vector.get(), SUNTRUE);
  return vector;
}

IdaSolver::IdaSolver(int unknowns) : n_(unknowns) {
  SUNContext context = nullptr;
  if (SUNContext_Create(SUN_COMM_NULL, &context) != 0) throw std::bad_alloc();
  context_.reset(context);
  for (Vector* vector : {&Y0_, &Yp0_, &tolerance_, &Y_, &Yp_, &between_}) *vector = new_vector();
  for (const Vector* vector : {&Y0_, &Yp0_}) N_VConst(0.0, vector->get());
  N_VConst(1.0, tolerance_.get());
  J_.reset(made(SUNDenseMatrix(unknowns, unknowns, context)));
  linear_solver_.reset(made(SUNLinSol_Dense(Y0_.get(), J_.get(), context)));
  ida_.reset(made(IDACreate(context)));
  void* const ida = ida_.get();
  // What IDA would print is said by whoever catches SolverError.
#if SUNDIALS_VERSION_MAJOR >= 7
  SUNContext_ClearErrHandlers(context);
#else
  check(IDASetErrFile(ida, nullptr), "IDASetErrFile");
#endif
  check(IDAInit(ida, residual, 0.0, Y0_.get(), Yp0_.get()), "IDAInit");
  check(IDASVtolerances(ida, 1e-6, tolerance_.get()), "IDASVtolerances");
  check(IDASetUserData(ida, this), "IDASetUserData");
  check(IDASetLinearSolver(ida, linear_solver_.get(), J_.get()), "IDASetLinearSolver");
  check(IDASetJacFn(ida, jacobian), "IDASetJacFn");
  check(IDASetMaxOrd(ida, highest_order), "IDASetMaxOrd");
  check(IDASetMinStep(ida, 1e-20), "IDASetMinStep");  // a motion without end would end in ever smaller steps
  check(IDASetMaxErrTestFails(ida, max_error_failures), "IDASetMaxErrTestFails");
  check(IDASetNonlinConvCoef(ida, newton_share), "IDASetNonlinConvCoef");
}

void IdaSolver::start(const ImplicitSystem& system, double relative_tolerance, double first_step, long most_steps) {
  void* const ida = ida_.get();
  system_ = &system;
  most_steps_ = most_steps;
  s_ = last_start_ = 0.0;
  N_VScale(1.0, Y0_.get(), Y_.get());
  check(IDAReInit(ida, 0.0, Y0_.get(), Yp0_.get()), "IDAReInit");
  check(IDASVtolerances(ida, relative_tolerance, tolerance_.get()), "IDASVtolerances");
  check(IDASetInitStep(ida, first_step), "IDASetInitStep");
  check(IDASetStopTime(ida, 1.0), "IDASetStopTime");
}

void IdaSolver::step() {
  if (steps() >= most_steps_) throw SolverError("it spans too much of the motion");
  last_start_ = s_;
  const int code = IDASolve(ida_.get(), 1.0, &s_, Y_.get(), Yp_.get(), IDA_ONE_STEP);
  if (code == IDA_REP_RES_ERR || code == IDA_FIRST_RES_FAIL)
    fail("values leave the range of floating-point numbers", code);
  check(code, "IDASolve");
}

IdaSolver::Polynomial IdaSolver::over_last_step(int unknown) const {
  Polynomial polynomial{};
  check(IDAGetLastOrder(ida_.get(), &polynomial.degree), "IDAGetLastOrder");
  double factor = 1.0;
  for (int k = 0; k <= polynomial.degree; ++k) {
    if (k > 0) factor *= last_size() / k;
    check(IDAGetDky(ida_.get(), last_start_, k, between_.get()), "IDAGetDky");
    polynomial.coefficients[static_cast<std::size_t>(k)] = factor * N_VGetArrayPointer(between_.get())[unknown];
  }
  return polynomial;
}

void IdaSolver::interpolate(double s) {
  check(IDAGetDky(ida_.get(), s, 0, Y_.get()), "IDAGetDky");
  s_ = s;
}

long IdaSolver::steps() const {
  long steps = 0;
  check(IDAGetNumSteps(ida_.get(), &steps), "IDAGetNumSteps");
  return steps;
}

}  // namespace spring
