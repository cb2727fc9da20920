// What a macro step asks of an FMU as one call: inputs, their derivatives, the step, outputs. Each call from Python
// takes about as long as what it calls here. Nothing is decided here but whether to go on: `functions.py` has the other
// end.
#include <cmath>
#include <cstddef>

#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"

#if defined(_WIN32)
#define EXPORTED extern "C" __declspec(dllexport)
#else
#define EXPORTED extern "C" __attribute__((visibility("default")))
#endif

namespace {

// As `functions.Advance` has it.
template <class Set, class SetDerivatives, class Step, class Get>
struct Advance {
  void* instance;
  Set* set;
  SetDerivatives* set_derivatives;
  Step* step;
  Get* get;
  std::size_t n_inputs, n_derivatives, n_outputs;
  const unsigned *inputs, *derivatives, *outputs;  // value references
  const int* orders;                               // of the derivatives
  const double *units_given, *units_reported;      // of the FMU, in SI units
  double* given;                                   // time, size, inputs, derivatives; in SI units, then in the FMU's
  double* reported;                                // outputs; in the FMU's units, then in SI units
  int always;                                      // whether derivatives are set that are all 0
};
using Advance2 = Advance<fmi2SetRealTYPE, fmi2SetRealInputDerivativesTYPE, fmi2DoStepTYPE, fmi2GetRealTYPE>;
using Advance3 = Advance<fmi3SetFloat64TYPE, fmi3SetFloat64TYPE, fmi3DoStepTYPE, fmi3GetFloat64TYPE>;

// As `functions.Failure` has it.
enum Failure { kInputsNotFinite = 1, kSet, kSetDerivatives, kStep, kGet, kOutputsNotFinite, kEnds, kEarly, kEvent };

int set(const Advance2& a, const double* values) { return a.set(a.instance, a.inputs, a.n_inputs, values); }
int set(const Advance3& a, const double* values) { return a.set(a.instance, a.inputs, a.n_inputs, values, a.n_inputs); }

int set_derivatives(const Advance2& a, const double* values) {
  return a.set_derivatives(a.instance, a.derivatives, a.n_derivatives, a.orders, values);
}
int set_derivatives(const Advance3& a, const double* values) {
  return a.set_derivatives(a.instance, a.derivatives, a.n_derivatives, values, a.n_derivatives);
}

int get(const Advance2& a) { return a.get(a.instance, a.outputs, a.n_outputs, a.reported); }
int get(const Advance3& a) { return a.get(a.instance, a.outputs, a.n_outputs, a.reported, a.n_outputs); }

bool finite(const double* values, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    if (!std::isfinite(values[i])) return false;
  }
  return true;
}

bool zero(const double* values, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    if (values[i] != 0.0) return false;
  }
  return true;
}

constexpr int kWarning = 1, kFatal = 4, kLast = 5;

// What went wrong, with the status of the call that did: 16 Failure + status. One that FMI does not know is fatal.
int failed(Failure what, int status) { return 16 * what + (status > kLast ? kFatal : status); }

int step(const Advance2& a) {
  const int status = a.step(a.instance, a.given[0], a.given[1], fmi2False);
  return status > kWarning ? failed(kStep, status) : 0;
}

int step(const Advance3& a) {
  fmi3Boolean event = false, ends = false, early = false;
  fmi3Float64 reached = 0.0;
  const int status = a.step(a.instance, a.given[0], a.given[1], fmi3False, &event, &ends, &early, &reached);
  if (status > kWarning) return failed(kStep, status);
  return ends ? failed(kEnds, status) : early ? failed(kEarly, status) : event ? failed(kEvent, status) : 0;
}

template <class A>
int advance(const A& a) {
  for (std::size_t i = 0; i < 2 + a.n_inputs + a.n_derivatives; ++i) a.given[i] /= a.units_given[i];
  const double* inputs = a.given + 2;
  const double* derivatives = inputs + a.n_inputs;
  if (!finite(inputs, a.n_inputs) || !finite(derivatives, a.n_derivatives)) return failed(kInputsNotFinite, 0);
  if (const int status = set(a, inputs); status > kWarning) return failed(kSet, status);
  if (a.n_derivatives > 0 && (a.always != 0 || !zero(derivatives, a.n_derivatives))) {
    if (const int status = set_derivatives(a, derivatives); status > kWarning) return failed(kSetDerivatives, status);
  }
  if (const int failure = step(a)) return failure;
  if (const int status = get(a); status > kWarning) return failed(kGet, status);
  for (std::size_t i = 0; i < a.n_outputs; ++i) a.reported[i] *= a.units_reported[i];
  return finite(a.reported, a.n_outputs) ? 0 : failed(kOutputsNotFinite, 0);
}

}  // namespace

EXPORTED int advance2(const Advance2* a) { return advance(*a); }
EXPORTED int advance3(const Advance3* a) { return advance(*a); }
