// The FMI 2.0 co-simulation functions over Component. Each states in which phases it may be called (FMI 2.0.4,
// section 4.2.4).
#include <cstddef>
#include <limits>
#include <new>
#include <string>

#include "common_functions.hpp"
#include "component.hpp"
#include "fmi2Functions.h"

using namespace fmi;

namespace {

fmi2Status to2(Status status) { return static_cast<fmi2Status>(status); }

/// `body` may be a member of Component, then with its arguments.
template <class Body, class... Arguments>
fmi2Status call(fmi2Component c, const char* function, unsigned legal, const Body& body, Arguments... arguments) {
  return to2(guard(c, function, legal, [&](Component& k) { std::invoke(body, k, arguments...); }));
}

template <class Value>
fmi2Status get(fmi2Component c, const char* function, const fmi2ValueReference vr[], size_t n, Value values[],
               Type type) {
  return call(c, function, any_phase, [&](Component& k) {
    require_arrays(n, {{vr, "the array of value references"}, {values, "the array of values"}});
    for (size_t i = 0; i < n; ++i) values[i] = static_cast<Value>(k.instance.get(vr[i], type));
  });
}

template <class Value>
fmi2Status set(fmi2Component c, const char* function, const fmi2ValueReference vr[], size_t n, const Value values[],
               Type type) {
  return call(c, function, settable, [&](Component& k) {
    require_arrays(n, {{vr, "the array of value references"}, {values, "the array of values"}});
    for (size_t i = 0; i < n; ++i) {
      k.instance.set(vr[i], type, static_cast<double>(type == Type::boolean ? Value(values[i] != 0) : values[i]));
    }
  });
}

/// Most of what could be asked is about a step that is pending, and none ever is.
template <class Value, class Get>
fmi2Status get_status(fmi2Component c, const char* function, bool known, Value* value, const Get& status_of) {
  return call(c, function, stepped, [&](Component& k) {
    require(value, "value");
    if (!known) throw Discarded("only fmi2LastSuccessfulTime and fmi2Terminated are known: no step is pending");
    *value = status_of(k);
  });
}

/// Some importers treat the message as a printf format, some print it as it is: both get a readable text.
std::string as_format(const std::string& message) {
  std::string format;
  for (const char c : message) format += c == '%' ? std::string("%%") : std::string(1, c);
  return format;
}

}  // namespace

extern "C" {

SPRINGBEAM_COMMON_FUNCTIONS(fmi2, FMUstate, DeSerialize)

const char* fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char* fmi2GetVersion(void) { return fmi2Version; }

/// `functions` may be NULL, and gone after the call.
fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID, fmi2String,
                              const fmi2CallbackFunctions* functions, fmi2Boolean, fmi2Boolean loggingOn) try {
  Log log;
  if (functions && functions->logger)
    log = [callbacks = *functions, name = std::string(instanceName ? instanceName : "?")](
              Status status, const char* category, const std::string& message) {
      callbacks.logger(callbacks.componentEnvironment, name.c_str(), to2(status), category, as_format(message).c_str());
    };
  return fmi::instantiate(__func__, log, loggingOn != fmi2False, type_names, fmuType == fmi2CoSimulation, instanceName,
                          fmuGUID);
} catch (const std::bad_alloc&) {
  return nullptr;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
  return call(c, __func__, instantiated, [&](Component& k) {
    k.instance.setup(startTime, stopTimeDefined ? stopTime : std::numeric_limits<double>::infinity(),
                     toleranceDefined ? tolerance : 0.0);
  });
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
  return call(c, __func__, instantiated, &Component::enter, initialization, "entered initialization mode");
}

#define SPRINGBEAM_VALUES(name, type)                                                                             \
  fmi2Status fmi2Get##name(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2##name values[]) {       \
    return get(c, __func__, vr, n, values, type);                                                                 \
  }                                                                                                               \
  fmi2Status fmi2Set##name(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2##name values[]) { \
    return set(c, __func__, vr, n, values, type);                                                                 \
  }
SPRINGBEAM_VALUES(Real, Type::real)
SPRINGBEAM_VALUES(Integer, Type::integer)
SPRINGBEAM_VALUES(Boolean, Type::boolean)
#undef SPRINGBEAM_VALUES

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference[], size_t n, fmi2String[]) {
  return call(c, __func__, any_phase, &Component::refuse_all, n, "String");
}
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference[], size_t n, const fmi2String[]) {
  return call(c, __func__, settable, &Component::refuse_all, n, "String");
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown, const fmi2Real dvKnown[],
                                        fmi2Real dvUnknown[]) {
  return call(c, __func__, after_instantiation, &Component::directional_derivative, vUnknown_ref, nUnknown, vKnown_ref,
              nKnown, dvKnown, dvUnknown);
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[]) {
  return call(c, __func__, settable, [&](Component& k) {
    require_arrays(nvr, {{vr, "the array of value references"}, {order, "order"}, {value, "value"}});
    for (size_t i = 0; i < nvr; ++i) k.instance.set_derivative(vr[i], order[i], value[i]);
  });
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[]) {
  return call(c, __func__, stepped, &Component::output_derivatives, vr, nvr, order, value);
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean) {
  return call(c, __func__, step_complete,
              [&](Component& k) { k.step(currentCommunicationPoint, communicationStepSize); });
}

fmi2Status fmi2CancelStep(fmi2Component c) {
  return call(c, __func__, 0, [](Component&) {});  // no step is ever in progress
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind, fmi2Status* value) {
  return get_status(c, __func__, false, value, [](const Component&) { return fmi2OK; });
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real* value) {
  return get_status(c, __func__, s == fmi2LastSuccessfulTime, value,
                    [](const Component& k) { return k.instance.progress.time; });
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind, fmi2Integer* value) {
  return get_status(c, __func__, false, value, [](const Component&) { return 0; });
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean* value) {
  return get_status(c, __func__, s == fmi2Terminated, value,
                    [](const Component& k) { return k.terminate_simulation ? fmi2True : fmi2False; });
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind, fmi2String* value) {
  return get_status(c, __func__, false, value, [](const Component&) { return ""; });
}

}  // extern "C"
