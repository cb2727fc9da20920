// The FMI 3.0 co-simulation functions over Component. Each states in which phases it may be called (FMI 3.0.2,
// sections 2.3 and 4.2).
#include <cstddef>
#include <limits>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>

#include "component.hpp"
#include "fmi3Functions.h"
#include "references3.hpp"

namespace {

using fmi::any_phase;
using fmi::Component;
using fmi::meant_by;
using fmi::require;
using fmi::require_arrays;
using fmi::settable;
using fmi::Status;
using fmi::Type;

/// A Component that knows what the importer can do.
struct Slave : Component {
  using Component::Component;
  bool event_mode_used = false, early_return_allowed = false;
};

fmi3Status to3(Status status) { return static_cast<fmi3Status>(status); }

template <class Body>
fmi3Status call(fmi3Instance c, const char* function, unsigned legal, const Body& body) {
  return to3(fmi::guard(c, function, legal, [&](Component& k) { body(static_cast<Slave&>(k)); }));
}

/// How many values a variable has.
std::size_t size_of(unsigned reference) {
  const auto& variables = fmi::table().variables;
  return reference < variables.size() ? variables[reference].elements : 1;
}

/// @throws std::invalid_argument unless there are `n_values` values in all, or if an element stands for an array
void require_sizes(const fmi3ValueReference vr[], size_t n, const void* values, size_t n_values) {
  require_arrays(n, {{vr, "the array of value references"}, {values, "the array of values"}});
  std::size_t sum = 0;
  for (size_t i = 0; i < n; ++i) {
    if (size_of(vr[i]) == 0)
      throw std::invalid_argument("value reference " + std::to_string(vr[i]) +
                                  " does not exist: it is within an array");
    sum += size_of(vr[i]);
  }
  if (sum != n_values)
    throw std::invalid_argument("nValues = " + std::to_string(n_values) + ", but the variables have " +
                                std::to_string(sum));
}

double get_one(Component& k, unsigned reference, Type type) {
  const auto [index, order] = meant_by(reference);
  if (index == fmi::time_index() && type == Type::real) return k.instance.progress.time;
  return order > 0 && type == Type::real ? k.instance.input_derivative(index, order) : k.instance.get(reference, type);
}

template <class Value>
fmi3Status get(fmi3Instance c, const char* function, const fmi3ValueReference vr[], size_t n, Value values[],
               size_t n_values, Type type) {
  return call(c, function, any_phase, [&](Slave& k) {
    require_sizes(vr, n, values, n_values);
    for (size_t i = 0, at = 0; i < n; ++i)
      for (unsigned element = 0; element < size_of(vr[i]); ++element)
        values[at++] = static_cast<Value>(get_one(k, vr[i] + element, type));
  });
}

template <class Value>
fmi3Status set(fmi3Instance c, const char* function, const fmi3ValueReference vr[], size_t n, const Value values[],
               size_t n_values, Type type) {
  return call(c, function, settable, [&](Slave& k) {
    require_sizes(vr, n, values, n_values);
    for (size_t i = 0; i < n; ++i) {  // no array can be set
      const auto [index, order] = meant_by(vr[i]);
      if (order > 0 && type == Type::real)
        k.instance.set_derivative(index, order, static_cast<double>(values[i]));
      else
        k.instance.set(vr[i], type, static_cast<double>(values[i]));
    }
  });
}

}  // namespace

extern "C" {

const char* fmi3GetVersion(void) { return "3.0"; }

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken, fmi3String,
                                         fmi3Boolean, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
                                         fmi3Boolean earlyReturnAllowed, const fmi3ValueReference[], size_t,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback logMessage,
                                         fmi3IntermediateUpdateCallback) {
  std::unique_ptr<Slave> slave;
  try {
    fmi::Log log;
    if (logMessage)
      log = [=](Status status, const char* category, const std::string& message) {
        logMessage(environment, to3(status), category, message.c_str());
      };
    slave = std::make_unique<Slave>(log, loggingOn);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
  slave->event_mode_used = eventModeUsed;
  slave->early_return_allowed = earlyReturnAllowed;
  if (fmi::instantiate(slave.get(), __func__, instanceName, instantiationToken) != Status::ok) return nullptr;
  return static_cast<Component*>(slave.release());
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String, fmi3String, fmi3String, fmi3Boolean, fmi3Boolean,
                                          fmi3InstanceEnvironment environment, fmi3LogMessageCallback logMessage) {
  if (logMessage)
    logMessage(environment, fmi3Error, "logStatusError",
               "fmi3InstantiateModelExchange: only co-simulation is provided");
  return nullptr;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String, fmi3String, fmi3String, fmi3Boolean, fmi3Boolean,
                                               fmi3InstanceEnvironment environment, fmi3LogMessageCallback logMessage,
                                               fmi3ClockUpdateCallback, fmi3LockPreemptionCallback,
                                               fmi3UnlockPreemptionCallback) {
  if (logMessage)
    logMessage(environment, fmi3Error, "logStatusError",
               "fmi3InstantiateScheduledExecution: only co-simulation is provided");
  return nullptr;
}

void fmi3FreeInstance(fmi3Instance c) { delete static_cast<Slave*>(static_cast<Component*>(c)); }

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[]) {
  return to3(fmi::set_debugging(c, __func__, loggingOn, nCategories, categories));
}

// Life cycle

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {
  return call(c, __func__, fmi::instantiated, [&](Slave& k) {
    k.instance.setup(startTime, stopTimeDefined ? stopTime : std::numeric_limits<double>::infinity(),
                     toleranceDefined ? tolerance : 0.0);
    k.enter(fmi::initialization, "entered initialization mode");
  });
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
  return call(c, __func__, fmi::initialization, [](Slave& k) {
    k.instance.ensure_built();
    k.enter(k.event_mode_used ? fmi::event_mode : fmi::step_complete, "initialized");
  });
}

fmi3Status fmi3EnterEventMode(fmi3Instance c) {
  return call(c, __func__, fmi::step_complete, [](Slave& k) {
    if (!k.event_mode_used) throw std::logic_error("not allowed: it was instantiated with eventModeUsed = false");
    k.enter(fmi::event_mode, "entered event mode");
  });
}

fmi3Status fmi3EnterStepMode(fmi3Instance c) {
  return call(c, __func__, fmi::event_mode, [](Slave& k) { k.enter(fmi::step_complete, "entered step mode"); });
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean* discreteStatesNeedUpdate,
                                    fmi3Boolean* terminateSimulation, fmi3Boolean* nominalsOfContinuousStatesChanged,
                                    fmi3Boolean* valuesOfContinuousStatesChanged, fmi3Boolean* nextEventTimeDefined,
                                    fmi3Float64* nextEventTime) {
  return call(c, __func__, fmi::event_mode, [&](Slave& k) {
    k.instance.update();
    for (fmi3Boolean* told : {discreteStatesNeedUpdate, terminateSimulation, nominalsOfContinuousStatesChanged,
                              valuesOfContinuousStatesChanged, nextEventTimeDefined})
      if (told) *told = fmi3False;
    if (nextEventTime) *nextEventTime = 0.0;
  });
}

fmi3Status fmi3Terminate(fmi3Instance c) {
  return call(c, __func__, fmi::running, [](Slave& k) { k.enter(fmi::terminated, "terminated"); });
}

fmi3Status fmi3Reset(fmi3Instance c) { return to3(fmi::reset(c, __func__)); }

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean, fmi3Boolean* eventHandlingNeeded, fmi3Boolean* terminateSimulation,
                      fmi3Boolean* earlyReturn, fmi3Float64* lastSuccessfulTime) {
  return call(c, __func__, fmi::step_complete, [&](Slave& k) {
    require(eventHandlingNeeded, "eventHandlingNeeded");
    require(terminateSimulation, "terminateSimulation");
    require(earlyReturn, "earlyReturn");
    require(lastSuccessfulTime, "lastSuccessfulTime");
    *eventHandlingNeeded = *terminateSimulation = *earlyReturn = fmi3False;
    *lastSuccessfulTime = k.instance.progress.time;
    const auto [size, event] =
        k.step("fmi3DoStep", currentCommunicationPoint, communicationStepSize, k.early_return_allowed);
    *lastSuccessfulTime = k.instance.progress.time;
    *earlyReturn = size != communicationStepSize;
    *eventHandlingNeeded = event && k.event_mode_used;
    if (event && !k.event_mode_used) k.instance.update();
  });
}

// Values

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 values[], size_t m) {
  return get(c, __func__, vr, n, values, m, Type::real);
}
fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Int32 values[], size_t m) {
  return get(c, __func__, vr, n, values, m, Type::integer);
}
fmi3Status fmi3GetBoolean(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Boolean values[], size_t m) {
  return get(c, __func__, vr, n, values, m, Type::boolean);
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 values[],
                          size_t m) {
  return set(c, __func__, vr, n, values, m, Type::real);
}
fmi3Status fmi3SetInt32(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Int32 values[], size_t m) {
  return set(c, __func__, vr, n, values, m, Type::integer);
}
fmi3Status fmi3SetBoolean(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Boolean values[],
                          size_t m) {
  return set(c, __func__, vr, n, values, m, Type::boolean);
}

#define SPRINGBEAM_NONE_OF(type)                                                                               \
  fmi3Status fmi3Get##type(fmi3Instance c, const fmi3ValueReference[], size_t n, fmi3##type[], size_t) {       \
    return to3(fmi::none_of(c, __func__, any_phase, n, #type));                                                \
  }                                                                                                            \
  fmi3Status fmi3Set##type(fmi3Instance c, const fmi3ValueReference[], size_t n, const fmi3##type[], size_t) { \
    return to3(fmi::none_of(c, __func__, settable, n, #type));                                                 \
  }
SPRINGBEAM_NONE_OF(Float32)
SPRINGBEAM_NONE_OF(Int8)
SPRINGBEAM_NONE_OF(UInt8)
SPRINGBEAM_NONE_OF(Int16)
SPRINGBEAM_NONE_OF(UInt16)
SPRINGBEAM_NONE_OF(UInt32)
SPRINGBEAM_NONE_OF(Int64)
SPRINGBEAM_NONE_OF(UInt64)
SPRINGBEAM_NONE_OF(String)
#undef SPRINGBEAM_NONE_OF

fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference[], size_t n, size_t[], fmi3Binary[], size_t) {
  return to3(fmi::none_of(c, __func__, any_phase, n, "Binary"));
}
fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference[], size_t n, const size_t[], const fmi3Binary[],
                         size_t) {
  return to3(fmi::none_of(c, __func__, settable, n, "Binary"));
}
fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference[], size_t n, fmi3Clock[]) {
  return to3(fmi::none_of(c, __func__, any_phase, n, "Clock"));
}
fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference[], size_t n, const fmi3Clock[]) {
  return to3(fmi::none_of(c, __func__, settable, n, "Clock"));
}

// States

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState* state) { return to3(fmi::get_state(c, __func__, state)); }
fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) { return to3(fmi::set_state(c, __func__, state)); }
fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState* state) { return to3(fmi::free_state(c, __func__, state)); }
fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t* size) {
  return to3(fmi::state_size(c, __func__, state, size));
}
fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size) {
  return to3(fmi::serialize_state(c, __func__, state, bytes, size));
}
fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState* state) {
  return to3(fmi::deserialize_state(c, __func__, bytes, size, state));
}

// Derivatives

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Int32 orders[],
                                    fmi3Float64 values[], size_t m) {
  const fmi3Status sizes = call(c, __func__, fmi::stepped, [&](Slave&) { require_sizes(vr, n, values, m); });
  return sizes == fmi3OK ? to3(fmi::output_derivatives(c, __func__, vr, n, orders, values)) : sizes;
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                        const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                        size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity) {
  const fmi3Status sizes = call(c, __func__, fmi::after_instantiation, [&](Slave&) {
    require_sizes(unknowns, nUnknowns, sensitivity, nSensitivity);
    require_sizes(knowns, nKnowns, seed, nSeed);
  });
  return sizes == fmi3OK
             ? to3(fmi::directional_derivative(c, __func__, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity))
             : sizes;
}

// What is not provided: the description says so. FMPy also looks for the functions of the other two interfaces.

#define SPRINGBEAM_NOT_PROVIDED(name, parameters)                                                   \
  fmi3Status name parameters {                                                                      \
    return call(c, __func__, any_phase, [](Slave&) { throw std::logic_error("is not provided"); }); \
  }
SPRINGBEAM_NOT_PROVIDED(fmi3GetNumberOfVariableDependencies, (fmi3Instance c, fmi3ValueReference, size_t*))
SPRINGBEAM_NOT_PROVIDED(fmi3GetVariableDependencies, (fmi3Instance c, fmi3ValueReference, size_t[],
                                                      fmi3ValueReference[], size_t[], fmi3DependencyKind[], size_t))
SPRINGBEAM_NOT_PROVIDED(fmi3GetAdjointDerivative,
                        (fmi3Instance c, const fmi3ValueReference[], size_t, const fmi3ValueReference[], size_t,
                         const fmi3Float64[], size_t, fmi3Float64[], size_t))
SPRINGBEAM_NOT_PROVIDED(fmi3GetIntervalDecimal,
                        (fmi3Instance c, const fmi3ValueReference[], size_t, fmi3Float64[], fmi3IntervalQualifier[]))
SPRINGBEAM_NOT_PROVIDED(fmi3GetIntervalFraction, (fmi3Instance c, const fmi3ValueReference[], size_t, fmi3UInt64[],
                                                  fmi3UInt64[], fmi3IntervalQualifier[]))
SPRINGBEAM_NOT_PROVIDED(fmi3GetShiftDecimal, (fmi3Instance c, const fmi3ValueReference[], size_t, fmi3Float64[]))
SPRINGBEAM_NOT_PROVIDED(fmi3GetShiftFraction,
                        (fmi3Instance c, const fmi3ValueReference[], size_t, fmi3UInt64[], fmi3UInt64[]))
SPRINGBEAM_NOT_PROVIDED(fmi3SetIntervalDecimal,
                        (fmi3Instance c, const fmi3ValueReference[], size_t, const fmi3Float64[]))
SPRINGBEAM_NOT_PROVIDED(fmi3SetIntervalFraction,
                        (fmi3Instance c, const fmi3ValueReference[], size_t, const fmi3UInt64[], const fmi3UInt64[]))
SPRINGBEAM_NOT_PROVIDED(fmi3SetShiftDecimal, (fmi3Instance c, const fmi3ValueReference[], size_t, const fmi3Float64[]))
SPRINGBEAM_NOT_PROVIDED(fmi3SetShiftFraction,
                        (fmi3Instance c, const fmi3ValueReference[], size_t, const fmi3UInt64[], const fmi3UInt64[]))
SPRINGBEAM_NOT_PROVIDED(fmi3EvaluateDiscreteStates, (fmi3Instance c))
SPRINGBEAM_NOT_PROVIDED(fmi3EnterConfigurationMode, (fmi3Instance c))
SPRINGBEAM_NOT_PROVIDED(fmi3ExitConfigurationMode, (fmi3Instance c))
SPRINGBEAM_NOT_PROVIDED(fmi3EnterContinuousTimeMode, (fmi3Instance c))
SPRINGBEAM_NOT_PROVIDED(fmi3CompletedIntegratorStep, (fmi3Instance c, fmi3Boolean, fmi3Boolean*, fmi3Boolean*))
SPRINGBEAM_NOT_PROVIDED(fmi3SetTime, (fmi3Instance c, fmi3Float64))
SPRINGBEAM_NOT_PROVIDED(fmi3SetContinuousStates, (fmi3Instance c, const fmi3Float64[], size_t))
SPRINGBEAM_NOT_PROVIDED(fmi3GetContinuousStateDerivatives, (fmi3Instance c, fmi3Float64[], size_t))
SPRINGBEAM_NOT_PROVIDED(fmi3GetEventIndicators, (fmi3Instance c, fmi3Float64[], size_t))
SPRINGBEAM_NOT_PROVIDED(fmi3GetContinuousStates, (fmi3Instance c, fmi3Float64[], size_t))
SPRINGBEAM_NOT_PROVIDED(fmi3GetNominalsOfContinuousStates, (fmi3Instance c, fmi3Float64[], size_t))
SPRINGBEAM_NOT_PROVIDED(fmi3GetNumberOfEventIndicators, (fmi3Instance c, size_t*))
SPRINGBEAM_NOT_PROVIDED(fmi3GetNumberOfContinuousStates, (fmi3Instance c, size_t*))
SPRINGBEAM_NOT_PROVIDED(fmi3ActivateModelPartition, (fmi3Instance c, fmi3ValueReference, fmi3Float64))
#undef SPRINGBEAM_NOT_PROVIDED

}  // extern "C"
