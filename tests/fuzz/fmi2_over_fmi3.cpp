// The functions of FMI 2.0 that the fuzzer calls, by those of FMI 3.0: so the same random calls and promises hold the
// other surface. Steps may end early, and event mode is used: a step goes on from event to event.
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "fmi2Functions.h"
#include "fmi3Functions.h"
#include "references3.hpp"
#include "snapshot.hpp"

namespace {

struct Experiment {
  bool with_tolerance = false, bounded = false;
  double tolerance = 0.0, start = 0.0, stop = 0.0;
};

struct Adapter {
  fmi2CallbackFunctions callbacks{};
  const char* called = "";  ///< what messages begin with
  fmi3Instance c = nullptr;
  Experiment experiment;
  std::map<void*, Experiment> saved;
  double reached = 0.0;
};

fmi3ValueReference reference3(unsigned index, int order) {
  return index + static_cast<unsigned>(order) * (fmi::time_index() + 1);
}

Adapter* adapter(fmi2Component c, const char* function) {
  static thread_local Adapter none;
  Adapter* const a = c ? static_cast<Adapter*>(c) : &none;
  a->called = function;
  return a;
}

void pass_on(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message) {
  const auto* a = static_cast<Adapter*>(environment);
  if (!a->callbacks.logger) return;
  const std::string text = message, named = a->called + text.substr(std::min(text.find(": "), text.size()));
  a->callbacks.logger(a->callbacks.componentEnvironment, "", static_cast<fmi2Status>(status), category, named.c_str());
}

fmi2Status to2(fmi3Status status) { return static_cast<fmi2Status>(status); }

/// An error in any phase, as FMI 2.0 has it where FMI 3.0 has no such function.
fmi2Status refuse(const Adapter* a) { return to2(fmi3EnterConfigurationMode(a->c)); }

bool may_be_initialized(const Adapter* a) {
  // The phase is the first number of a state, after the GUID and a checksum (snapshot.cpp).
  fmi3FMUState state = nullptr;
  std::size_t size = 0;
  double phase = 0.0;
  if (fmi3GetFMUState(a->c, &state) != fmi3OK || fmi3SerializedFMUStateSize(a->c, state, &size) != fmi3OK) return false;
  std::vector<fmi3Byte> bytes(size);
  fmi3SerializeFMUState(a->c, state, bytes.data(), size);
  fmi3FreeFMUState(a->c, &state);
  std::copy_n(bytes.begin() + fmi::guid().size() + 8, sizeof phase, reinterpret_cast<fmi3Byte*>(&phase));
  return phase == fmi::instantiated;
}

fmi3Status enter(const Adapter* a, const Experiment& e) {
  return fmi3EnterInitializationMode(a->c, e.with_tolerance, e.tolerance, e.start, e.bounded, e.stop);
}

fmi3Status handle_event(const Adapter* a) {
  fmi3Boolean told[5];
  double next = 0.0;
  const fmi3Status status = fmi3UpdateDiscreteStates(a->c, told, told + 1, told + 2, told + 3, told + 4, &next);
  return status == fmi3OK ? fmi3EnterStepMode(a->c) : status;
}

/// The reference in FMI 3.0: what is no variable of FMI 2.0 is none there.
unsigned reference(fmi2ValueReference r) { return r < fmi::time_index() ? r : ~0U; }

/// `get` and `set` take one reference, one value, and how many values there are.
template <class Theirs, class Ours, class Get>
fmi2Status get_all(const Adapter* a, const fmi2ValueReference vr[], std::size_t n, Ours values[], const Get& get) {
  if (n == 0 || !vr || !values) return to2(get(a->c, vr, n, static_cast<Theirs*>(nullptr), n));
  for (std::size_t i = 0; i < n; ++i) {
    unsigned r = reference(vr[i]);
    std::size_t within = 0, size = 1;
    if (r != ~0U) {
      for (; fmi::table().variables[r].elements == 0; --r) ++within;
      size = fmi::table().variables[r].elements;
    }
    const auto found = std::make_unique<Theirs[]>(size);
    const fmi3Status status = get(a->c, &r, 1, found.get(), size);
    if (status != fmi3OK) return to2(status);
    values[i] = static_cast<Ours>(found[within]);
  }
  return fmi2OK;
}

template <class Theirs, class Ours, class Set>
fmi2Status set_all(const Adapter* a, const fmi2ValueReference vr[], std::size_t n, const Ours values[],
                   const Set& set) {
  if (n == 0 || !vr || !values) return to2(set(a->c, vr, n, static_cast<const Theirs*>(nullptr), n));
  for (std::size_t i = 0; i < n; ++i) {
    const unsigned r = reference(vr[i]);
    const auto value = static_cast<Theirs>(values[i]);
    const fmi3Status status = set(a->c, &r, 1, &value, 1);
    if (status != fmi3OK) return to2(status);
  }
  return fmi2OK;
}

template <class Value>
fmi2Status tell(Adapter* a, bool known, Value* to, Value value) {
  // Allowed in the same phases.
  const fmi3Status status = fmi3GetOutputDerivatives(a->c, nullptr, 0, nullptr, nullptr, 0);
  if (status != fmi3OK) return to2(status);
  if (!to) return refuse(a);
  if (known) return *to = value, fmi2OK;
  pass_on(a, fmi3Discard, "", ": is not known");
  return fmi2Discard;
}

}  // namespace

extern "C" {

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* functions, fmi2Boolean, fmi2Boolean logging) {
  auto made = std::make_unique<Adapter>();
  made->called = __func__;
  if (functions) made->callbacks = *functions;
  if (type == fmi2CoSimulation)
    made->c = fmi3InstantiateCoSimulation(name, guid, resources, false, logging != 0, true, true, nullptr, 0,
                                          made.get(), pass_on, nullptr);
  return made->c ? made.release() : nullptr;
}
void fmi2FreeInstance(fmi2Component c) {
  if (!c) return;
  fmi3FreeInstance(static_cast<Adapter*>(c)->c);
  delete static_cast<Adapter*>(c);
}
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
  return to2(fmi3SetDebugLogging(adapter(c, __func__)->c, on != 0, n, categories));
}
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean with_tolerance, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean bounded, fmi2Real stop) {
  Adapter* const a = adapter(c, __func__);
  const Experiment wanted{with_tolerance != 0, bounded != 0, tolerance, start, stop};
  const bool right = std::isfinite(start) && (!bounded || stop >= start);
  if (!right || !may_be_initialized(a)) return to2(enter(a, wanted));  // refused
  a->experiment = wanted;
  return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
  Adapter* const a = adapter(c, __func__);
  return to2(enter(a, a->experiment));
}
fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
  Adapter* const a = adapter(c, __func__);
  const fmi3Status status = fmi3ExitInitializationMode(a->c);
  return to2(status == fmi3OK ? handle_event(a) : status);
}
fmi2Status fmi2Terminate(fmi2Component c) { return to2(fmi3Terminate(adapter(c, __func__)->c)); }
fmi2Status fmi2Reset(fmi2Component c) {
  Adapter* const a = adapter(c, __func__);
  a->experiment = {};
  return to2(fmi3Reset(a->c));
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
  return get_all<double>(adapter(c, __func__), vr, n, value, fmi3GetFloat64);
}
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer value[]) {
  return get_all<fmi3Int32>(adapter(c, __func__), vr, n, value, fmi3GetInt32);
}
fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Boolean value[]) {
  return get_all<bool>(adapter(c, __func__), vr, n, value, fmi3GetBoolean);
}
fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2String value[]) {
  return to2(fmi3GetString(adapter(c, __func__)->c, vr, n, value, n));
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
  return set_all<double>(adapter(c, __func__), vr, n, value, fmi3SetFloat64);
}
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer value[]) {
  return set_all<fmi3Int32>(adapter(c, __func__), vr, n, value, fmi3SetInt32);
}
fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Boolean value[]) {
  return set_all<bool>(adapter(c, __func__), vr, n, value, fmi3SetBoolean);
}
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2String value[]) {
  return to2(fmi3SetString(adapter(c, __func__)->c, vr, n, value, n));
}
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer order[], const fmi2Real value[]) {
  Adapter* const a = adapter(c, __func__);
  if (n == 0) return to2(fmi3SetFloat64(a->c, nullptr, 0, nullptr, 0));
  if (!vr || !order || !value) return refuse(a);
  for (size_t i = 0; i < n; ++i) {
    if (order[i] < 1 || order[i] > 2 || vr[i] >= fmi::time_index()) return refuse(a);
    const unsigned r = reference3(vr[i], order[i]);
    const fmi3Status status = fmi3SetFloat64(a->c, &r, 1, value + i, 1);
    if (status != fmi3OK) return to2(status);
  }
  return fmi2OK;
}
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                        const fmi2Integer order[], fmi2Real value[]) {
  return to2(fmi3GetOutputDerivatives(adapter(c, __func__)->c, vr, n, order, value, n));
}
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[], size_t n_unknowns,
                                        const fmi2ValueReference knowns[], size_t n_knowns, const fmi2Real seed[],
                                        fmi2Real result[]) {
  return to2(fmi3GetDirectionalDerivative(adapter(c, __func__)->c, unknowns, n_unknowns, knowns, n_knowns, seed,
                                          n_knowns, result, n_unknowns));
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate* state) {
  Adapter* const a = adapter(c, __func__);
  const fmi3Status status = fmi3GetFMUState(a->c, state);
  if (status == fmi3OK) a->saved[*state] = a->experiment;
  return to2(status);
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
  Adapter* const a = adapter(c, __func__);
  const fmi3Status status = fmi3SetFMUState(a->c, state);
  if (status == fmi3OK) a->experiment = a->saved[state];
  return to2(status);
}
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate* state) {
  return to2(fmi3FreeFMUState(adapter(c, __func__)->c, state));
}
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t* size) {
  return to2(fmi3SerializedFMUStateSize(adapter(c, __func__)->c, state, size));
}
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
  return to2(fmi3SerializeFMUState(adapter(c, __func__)->c, state, reinterpret_cast<fmi3Byte*>(bytes), size));
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate* state) {
  return to2(fmi3DeserializeFMUState(adapter(c, __func__)->c, reinterpret_cast<const fmi3Byte*>(bytes), size, state));
}

/// From event to event to the end; back to where it began if a part is discarded, or there are too many to wait for.
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real size, fmi2Boolean) {
  constexpr int most_events = 100;
  Adapter* const a = adapter(c, __func__);
  const unsigned clock = fmi::time_index();
  double began = 0.0;
  fmi3FMUState before = nullptr;
  fmi3Boolean event = false, end = false, early = true;
  fmi3Status status = fmi3OK;
  if (a->c) {
    fmi3GetFMUState(a->c, &before);
    fmi3GetFloat64(a->c, &clock, 1, &began, 1);
  }
  a->reached = time;
  int events = 0;
  for (double left = size; status == fmi3OK && early; left = time + size - a->reached) {
    if (++events > most_events) {
      pass_on(a, status = fmi3Discard, "", ": too many events");
      break;
    }
    if (events > 1 && !(left > 0.0)) break;
    status = fmi3DoStep(a->c, a->reached, left, false, &event, &end, &early, &a->reached);
    if (status == fmi3OK && event) status = fmi3EnterEventMode(a->c);
    if (status == fmi3OK && event) status = handle_event(a);
  }
  if (status == fmi3Discard) {
    fmi3SetFMUState(a->c, before);
    a->reached = began;
  }
  if (a->c) fmi3FreeFMUState(a->c, &before);
  return to2(status);
}
fmi2Status fmi2CancelStep(fmi2Component c) { return refuse(adapter(c, __func__)); }
fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind, fmi2Status* value) {
  return tell(adapter(c, __func__), false, value, fmi2OK);
}
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real* value) {
  Adapter* const a = adapter(c, __func__);
  return tell(a, s == fmi2LastSuccessfulTime, value, a->reached);
}
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind, fmi2Integer* value) {
  return tell(adapter(c, __func__), false, value, 0);
}
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean* value) {
  return tell(adapter(c, __func__), s == fmi2Terminated, value, fmi2False);
}
fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind, fmi2String* value) {
  return tell(adapter(c, __func__), false, value, static_cast<fmi2String>(""));
}

}  // extern "C"
