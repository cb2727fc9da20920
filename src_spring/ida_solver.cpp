#include "ida_solver.hpp"

#include <ida/ida.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

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

struct ContextDeleter {
  void operator()(SUNContext context) const { SUNContext_Free(&context); }
};
struct VectorDeleter {
  void operator()(N_Vector vector) const { N_VDestroy(vector); }
};
struct MatrixDeleter {
  void operator()(SUNMatrix matrix) const { SUNMatDestroy(matrix); }
};
struct LinearSolverDeleter {
  void operator()(SUNLinearSolver solver) const { SUNLinSolFree(solver); }
};
struct IdaDeleter {
  void operator()(void* ida) const { IDAFree(&ida); }
};
template <class Handle, class Deleter>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Deleter>;

double* data(N_Vector vector) { return N_VGetArrayPointer(vector); }

/// What the callbacks see.
struct Problem {
  const ImplicitSystem* system = nullptr;
  std::vector<Crossing> crossings;
};

const ImplicitSystem& system_of(void* user_data) { return *static_cast<const Problem*>(user_data)->system; }

int residual(sunrealtype s, N_Vector Y, N_Vector Yp, N_Vector F, void* user_data) {
  return system_of(user_data).residual(s, data(Y), data(Yp), data(F)) ? 0 : 1;
}

int jacobian(sunrealtype s, sunrealtype c, N_Vector Y, N_Vector Yp, N_Vector, SUNMatrix J, void* user_data, N_Vector,
             N_Vector, N_Vector) {
  system_of(user_data).jacobian(s, c, data(Y), data(Yp), SUNDenseMatrix_Data(J));
  return 0;
}

int events(sunrealtype s, N_Vector Y, N_Vector, sunrealtype* g, void* user_data) {
  const auto& problem = *static_cast<const Problem*>(user_data);
  problem.system->events(s, data(Y), g);
  for (std::size_t i = 0; i < problem.crossings.size(); ++i) {
    if (std::isnan(g[i])) return 1;  // IDA would search for its root without end
    // A rate of the power law may be infinite at a start; only its sign matters.
    if (std::isinf(g[i])) g[i] = std::copysign(1e100, g[i]);
  }
  // An exact zero counts as not yet crossed: IDA would switch the event function off, and keep it off after IDAReInit.
  // Not the smallest double: IDA multiplies values to compare signs.
  for (std::size_t i = 0; i < problem.crossings.size(); ++i)
    if (g[i] == 0.0) g[i] = -static_cast<int>(problem.crossings[i]) * 1e-100;
  return 0;
}

}  // namespace

struct IdaSolver::Impl {
  // Order matters: the context outlives everything made in it.
  Owned<SUNContext, ContextDeleter> context;
  Owned<N_Vector, VectorDeleter> Y0, Yp0, tolerance, Y, Yp;
  Owned<SUNMatrix, MatrixDeleter> J;
  Owned<SUNLinearSolver, LinearSolverDeleter> linear_solver;
  std::unique_ptr<void, IdaDeleter> ida;
  Problem problem;
  int n = 0;
  std::vector<int> occurred;
  std::vector<double> event_values;
  double s = 0.0;
  long most_steps = 0;

  [[noreturn]] static void fail(const char* what, int code) {
    std::unique_ptr<char, decltype(&std::free)> name(IDAGetReturnFlagName(code), &std::free);
    throw IdaError(std::string(what) + ": " + (name ? name.get() : "unknown flag"));
  }
  static void check(int code, const char* what) {
    if (code < 0) fail(what, code);
  }
  N_Vector new_vector() const {
    N_Vector vector = N_VNew_Serial(n, context.get());
    if (vector == nullptr) throw std::bad_alloc();
    N_VEnableFusedOps_Serial(vector, SUNTRUE);
    return vector;
  }
};

IdaSolver::IdaSolver(int unknowns, const std::vector<Crossing>& crossings) : impl_(std::make_unique<Impl>()) {
  Impl& d = *impl_;
  d.n = unknowns;
  d.problem.crossings = crossings;
  d.occurred.assign(crossings.size(), 0);
  d.event_values.assign(crossings.size(), 0.0);
  SUNContext context = nullptr;
  if (SUNContext_Create(SUN_COMM_NULL, &context) != 0) throw std::bad_alloc();
  d.context.reset(context);
  for (auto* vector : {&d.Y0, &d.Yp0, &d.tolerance, &d.Y, &d.Yp}) vector->reset(d.new_vector());
  for (N_Vector vector : {d.Y0.get(), d.Yp0.get()}) N_VConst(0.0, vector);
  N_VConst(1.0, d.tolerance.get());
  d.J.reset(SUNDenseMatrix(unknowns, unknowns, context));
  if (!d.J) throw std::bad_alloc();
  d.linear_solver.reset(SUNLinSol_Dense(d.Y0.get(), d.J.get(), context));
  if (!d.linear_solver) throw std::bad_alloc();
  d.ida.reset(IDACreate(context));
  if (!d.ida) throw std::bad_alloc();
  void* ida = d.ida.get();
  // What IDA would print is said by whoever catches IdaError.
#if SUNDIALS_VERSION_MAJOR >= 7
  SUNContext_ClearErrHandlers(context);
#else
  d.check(IDASetErrFile(ida, nullptr), "IDASetErrFile");
#endif
  d.check(IDAInit(ida, residual, 0.0, d.Y0.get(), d.Yp0.get()), "IDAInit");
  d.check(IDASVtolerances(ida, 1e-6, d.tolerance.get()), "IDASVtolerances");
  d.check(IDASetUserData(ida, &d.problem), "IDASetUserData");
  d.check(IDASetLinearSolver(ida, d.linear_solver.get(), d.J.get()), "IDASetLinearSolver");
  d.check(IDASetJacFn(ida, jacobian), "IDASetJacFn");
  d.check(IDASetMaxOrd(ida, max_order), "IDASetMaxOrd");
  d.check(IDASetMaxErrTestFails(ida, max_error_failures), "IDASetMaxErrTestFails");
  d.check(IDASetNonlinConvCoef(ida, newton_share), "IDASetNonlinConvCoef");
  if (!crossings.empty()) {
    d.check(IDARootInit(ida, static_cast<int>(crossings.size()), events), "IDARootInit");
    std::vector<int> directions(crossings.size());
    std::transform(crossings.begin(), crossings.end(), directions.begin(),
                   [](Crossing c) { return static_cast<int>(c); });
    d.check(IDASetRootDirection(ida, directions.data()), "IDASetRootDirection");
    d.check(IDASetNoInactiveRootWarn(ida), "IDASetNoInactiveRootWarn");
  }
}

IdaSolver::~IdaSolver() = default;

double* IdaSolver::initial_value() { return data(impl_->Y0.get()); }
double* IdaSolver::initial_derivative() { return data(impl_->Yp0.get()); }
double* IdaSolver::absolute_tolerance() { return data(impl_->tolerance.get()); }

void IdaSolver::start(const ImplicitSystem& system, double relative_tolerance, double first_step, long most_steps) {
  Impl& d = *impl_;
  void* ida = d.ida.get();
  d.most_steps = most_steps;
  d.problem.system = &system;
  d.s = 0.0;
  d.check(IDAReInit(ida, 0.0, d.Y0.get(), d.Yp0.get()), "IDAReInit");
  d.check(IDASVtolerances(ida, relative_tolerance, d.tolerance.get()), "IDASVtolerances");
  d.check(IDASetInitStep(ida, first_step), "IDASetInitStep");
  d.check(IDASetStopTime(ida, 1.0), "IDASetStopTime");
}

IdaSolver::Outcome IdaSolver::advance() {
  Impl& d = *impl_;
  // IDA counts from event to event.
  const long left = d.most_steps - steps();
  if (left <= 0) throw TooMuchWork();
  d.check(IDASetMaxNumSteps(d.ida.get(), left), "IDASetMaxNumSteps");
  const int code = IDASolve(d.ida.get(), 1.0, &d.s, d.Y.get(), d.Yp.get(), IDA_NORMAL);
  if (code == IDA_TOO_MUCH_WORK) throw TooMuchWork();
  if (code == IDA_REP_RES_ERR || code == IDA_FIRST_RES_FAIL || code == IDA_RTFUNC_FAIL)
    Impl::fail("values leave the range of floating-point numbers", code);
  if (code < 0) d.fail("IDASolve", code);
  if (code != IDA_ROOT_RETURN) return Outcome::finished;
  d.check(IDAGetRootInfo(d.ida.get(), d.occurred.data()), "IDAGetRootInfo");
  return Outcome::event;
}

double IdaSolver::s() const { return impl_->s; }
const double* IdaSolver::value() const { return data(impl_->Y.get()); }
bool IdaSolver::occurred(int event) const { return impl_->occurred[static_cast<std::size_t>(event)] != 0; }

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

double IdaSolver::event_value(int event) const {
  std::vector<double>& g = impl_->event_values;
  impl_->problem.system->events(s(), value(), g.data());
  return g[static_cast<std::size_t>(event)];
}

double IdaSolver::last_step_start() const {
  double end = 0.0, size = 0.0;
  impl_->check(IDAGetCurrentTime(impl_->ida.get(), &end), "IDAGetCurrentTime");
  impl_->check(IDAGetLastStep(impl_->ida.get(), &size), "IDAGetLastStep");
  return end - size;
}

void IdaSolver::interpolate(double s) {
  Impl& d = *impl_;
  d.check(IDAGetDky(d.ida.get(), s, 0, d.Y.get()), "IDAGetDky");
  d.s = s;
}

long IdaSolver::steps() const {
  long steps = 0;
  impl_->check(IDAGetNumSteps(impl_->ida.get(), &steps), "IDAGetNumSteps");
  return steps;
}

}  // namespace spring
