#include "ida_solver.hpp"

#include <ida/ida.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <algorithm>
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
constexpr double root_bracket = 400.0 * epsilon;  ///< IDA's is 100 ε (s + h), s and h ≤ 1
constexpr int max_order = 5;
// Newton's remainder, relative to the tolerance: small, or it is noise in the error estimate (IDA's default, 0.33,
// costs more steps than it saves iterations).
constexpr double newton_share = 0.01;
constexpr int max_error_failures = 40;  ///< in one internal step: a first step that is far too long recovers

[[noreturn]] void fail(const char* what, int code) {
  std::unique_ptr<char, decltype(&std::free)> name(IDAGetReturnFlagName(code), &std::free);
  throw IdaError(std::string(what) + ": " + (name ? name.get() : "unknown flag"));
}

void check(int code, const char* what) {
  if (code < 0) fail(what, code);
}

template <class Owned, class Handle>
void own(Owned& owner, Handle made) {
  if (made == nullptr) throw std::bad_alloc();
  owner.reset(made);
}

}  // namespace

void IdaSolver::free_context(SUNContext context) { SUNContext_Free(&context); }
void IdaSolver::free_solver(SUNLinearSolver solver) { SUNLinSolFree(solver); }
void IdaSolver::free_ida(void* ida) { IDAFree(&ida); }

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

int IdaSolver::events(double s, N_Vector Y, N_Vector, double* g, void* solver) {
  const std::vector<Crossing>& crossings = static_cast<const IdaSolver*>(solver)->crossings_;
  static_cast<const IdaSolver*>(solver)->system_->events(s, N_VGetArrayPointer(Y), g);
  for (std::size_t i = 0; i < crossings.size(); ++i) {
    if (std::isnan(g[i])) return 1;  // IDA would search for its root without end
    // A rate of the power law may be infinite at a start; only its sign matters.
    if (std::isinf(g[i])) g[i] = std::copysign(1e100, g[i]);
    // An exact zero counts as not yet crossed: IDA would switch the event function off, and keep it off after
    // IDAReInit. Not the smallest double: IDA multiplies values to compare signs.
    if (g[i] == 0.0) g[i] = -static_cast<int>(crossings[i]) * 1e-100;
  }
  return 0;
}

IdaSolver::Vector IdaSolver::new_vector() const {
  Vector vector;
  own(vector, N_VNew_Serial(n_, context_.get()));
  N_VEnableFusedOps_Serial(vector.get(), SUNTRUE);
  return vector;
}

IdaSolver::IdaSolver(int unknowns, const std::vector<Crossing>& crossings)
    : n_(unknowns), crossings_(crossings), occurred_(crossings.size()), event_values_(crossings.size()) {
  SUNContext context = nullptr;
  if (SUNContext_Create(SUN_COMM_NULL, &context) != 0) throw std::bad_alloc();
  context_.reset(context);
  for (Vector* vector : {&Y0_, &Yp0_, &tolerance_, &Y_, &Yp_}) *vector = new_vector();
  for (const Vector* vector : {&Y0_, &Yp0_}) N_VConst(0.0, vector->get());
  N_VConst(1.0, tolerance_.get());
  own(J_, SUNDenseMatrix(unknowns, unknowns, context));
  own(linear_solver_, SUNLinSol_Dense(Y0_.get(), J_.get(), context));
  own(ida_, IDACreate(context));
  void* const ida = ida_.get();
  // What IDA would print is said by whoever catches IdaError.
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
  check(IDASetMaxOrd(ida, max_order), "IDASetMaxOrd");
  check(IDASetMinStep(ida, 1e-20), "IDASetMinStep");  // a motion without end would end in ever smaller steps
  check(IDASetMaxErrTestFails(ida, max_error_failures), "IDASetMaxErrTestFails");
  check(IDASetNonlinConvCoef(ida, newton_share), "IDASetNonlinConvCoef");
  if (crossings.empty()) return;
  check(IDARootInit(ida, static_cast<int>(crossings.size()), events), "IDARootInit");
  std::vector<int> directions(crossings.size());
  std::transform(crossings.begin(), crossings.end(), directions.begin(),
                 [](Crossing c) { return static_cast<int>(c); });
  check(IDASetRootDirection(ida, directions.data()), "IDASetRootDirection");
  check(IDASetNoInactiveRootWarn(ida), "IDASetNoInactiveRootWarn");
}

void IdaSolver::start(const ImplicitSystem& system, double relative_tolerance, double first_step, long most_steps) {
  void* const ida = ida_.get();
  system_ = &system;
  most_steps_ = most_steps;
  s_ = 0.0;
  check(IDAReInit(ida, 0.0, Y0_.get(), Yp0_.get()), "IDAReInit");
  check(IDASVtolerances(ida, relative_tolerance, tolerance_.get()), "IDASVtolerances");
  check(IDASetInitStep(ida, first_step), "IDASetInitStep");
  check(IDASetStopTime(ida, 1.0), "IDASetStopTime");
}

IdaSolver::Outcome IdaSolver::advance() {
  void* const ida = ida_.get();
  // IDA counts from event to event.
  const long left = most_steps_ - steps();
  if (left <= 0) throw TooMuchWork();
  check(IDASetMaxNumSteps(ida, left), "IDASetMaxNumSteps");
  const int code = IDASolve(ida, 1.0, &s_, Y_.get(), Yp_.get(), IDA_NORMAL);
  if (code == IDA_TOO_MUCH_WORK) throw TooMuchWork();
  if (code == IDA_REP_RES_ERR || code == IDA_FIRST_RES_FAIL || code == IDA_RTFUNC_FAIL)
    fail("values leave the range of floating-point numbers", code);
  check(code, "IDASolve");
  if (code != IDA_ROOT_RETURN) return Outcome::finished;
  check(IDAGetRootInfo(ida, occurred_.data()), "IDAGetRootInfo");
  return Outcome::event;
}

bool IdaSolver::fell(int distance) {
  const bool passed = occurred(distance);
  if (!passed && (!occurred(distance + 1) || event_value(distance) >= 0.0)) return false;
  // IDA's own bracket is 100 ulp wide: narrow it, on the same interpolant.
  const double first = last_step_start();
  double below = s(), above = first;
  if (passed) {
    interpolate(std::max(first, below - root_bracket));
    if (event_value(distance) > 0.0) above = s();
  }
  while (below - above > 2.0 * epsilon) {
    const double middle = above + (below - above) / 2;
    interpolate(middle);
    (event_value(distance) < 0.0 ? below : above) = middle;
  }
  interpolate(above);
  return true;
}

double IdaSolver::event_value(int event) {
  system_->events(s_, value(), event_values_.data());
  return event_values_[static_cast<std::size_t>(event)];
}

double IdaSolver::last_step_start() const {
  double end = 0.0, size = 0.0;
  check(IDAGetCurrentTime(ida_.get(), &end), "IDAGetCurrentTime");
  check(IDAGetLastStep(ida_.get(), &size), "IDAGetLastStep");
  return end - size;
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
