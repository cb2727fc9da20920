// The FMI 3.0 co-simulation functions over Component. Each states in which phases it may be called (FMI 3.0.2,
// sections 2.3 and 4.2).
#include <cstddef>
#include <limits>
#include <new>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "common_functions.hpp"
#include "component.hpp"
#include "fmi3Functions.h"
#include "references3.hpp"

using namespace fmi;

namespace {

fmi3Status to3(Status status) { return static_cast<fmi3Status>(status); }

/// `body` may be a member of Component, then with its arguments.
template <class Body, class... Arguments>
fmi3Status call(fmi3Instance c, const char* function, unsigned legal, const Body& body, Arguments... arguments) {
  return to3(guard(c, function, legal, [&](Component& k) { std::invoke(body, k, arguments...); }));
}

fmi3Instance instantiate(const char* function, bool co_simulation, fmi3String name, fmi3String token, bool log_events,
                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback send) try {
  Log log;
  if (send)
    log = [=](Status status, const char* category, const std::string& message) {
      send(environment, to3(status), category, message.c_str());
    };
  return fmi::instantiate(function, log, log_events, TypeNames{"Float64", "Int32", "Boolean"}, co_simulation, name,
                          token);
} catch (const std::bad_alloc&) {
  return nullptr;
}

/// How many values a variable has; none that is an element of an array.
std::size_t size_of(unsigned reference) {
  const auto& variables = table().variables;
  return reference < variables.size() ? variables[reference].elements : 1;
}

/// @throws std::invalid_argument unless there are `n_values` values in all
void require_sizes(const fmi3ValueReference vr[], size_t n, const void* values, size_t n_values) {
  require_arrays(n, {{vr, "the array of value references"}, {values, "the array of values"}});
  std::size_t sum = 0;
  for (size_t i = 0; i < n; ++i) sum += size_of(vr[i]);
  if (sum != n_values)
    throw std::invalid_argument("nValues = " + std::to_string(n_values) + ", but the variables have " +
                                std::to_string(sum));
}

/// What variables hold that functions for C's type `Value` reach.
template <class Value>
constexpr bool is_real = std::is_same_v<Value, fmi3Float64>;
template <class Value>
constexpr Type type_of = is_real<Value>                       ? Type::real
                         : std::is_same_v<Value, fmi3Boolean> ? Type::boolean
                                                              : Type::integer;

template <class Value>
Value get_one(Component& k, unsigned reference) {
  const auto [index, order] = meant_by(reference);
  const double value = is_real<Value> && index == time_index() ? k.instance.progress.time
                       : is_real<Value> && order > 0           ? k.instance.input_derivative(index, order)
                                                               : k.instance.get(reference, type_of<Value>);
  return static_cast<Value>(value);
}

template <class Value>
fmi3Status get(fmi3Instance c, const char* function, const fmi3ValueReference vr[], size_t n, Value values[],
               size_t n_values) {
  return call(c, function, any_phase, [&](Component& k) {
    require_sizes(vr, n, values, n_values);
    for (size_t i = 0; i < n; ++i)
      for (unsigned element = 0; element < size_of(vr[i]); ++element) *values++ = get_one<Value>(k, vr[i] + element);
  });
}

template <class Value>
fmi3Status set(fmi3Instance c, const char* function, const fmi3ValueReference vr[], size_t n, const Value values[],
               size_t n_values) {
  return call(c, function, settable, [&](Component& k) {
    require_sizes(vr, n, values, n_values);
    for (size_t i = 0; i < n; ++i) {  // no array can be set
      const auto [index, order] = meant_by(vr[i]);
      if (is_real<Value> && order > 0)
        k.instance.set_derivative(index, order, static_cast<double>(values[i]));
      else
        k.instance.set(vr[i], type_of<Value>, static_cast<double>(values[i]));
    }
  });
}

}  // namespace

extern "C" {

SPRINGBEAM_COMMON_FUNCTIONS(fmi3, FMUState, Deserialize)

const char* fmi3GetVersion(void) { return "3.0"; }

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken, fmi3String,
                                         fmi3Boolean, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
                                         fmi3Boolean earlyReturnAllowed, const fmi3ValueReference[], size_t,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback logMessage,
                                         fmi3IntermediateUpdateCallback) {
  auto* const c = instantiate(__func__, true, instanceName, instantiationToken, loggingOn, environment, logMessage);
  if (c) {
    static_cast<Component*>(c)->event_mode_used = eventModeUsed;
    static_cast<Component*>(c)->early_return_allowed = earlyReturnAllowed;
  }
  return c;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String, fmi3Boolean, fmi3Boolean,
                                          fmi3InstanceEnvironment environment, fmi3LogMessageCallback logMessage) {
  return instantiate(__func__, false, name, token, false, environment, logMessage);
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String, fmi3Boolean, fmi3Boolean,
                                               fmi3InstanceEnvironment environment, fmi3LogMessageCallback logMessage,
                                               fmi3ClockUpdateCallback, fmi3LockPreemptionCallback,
                                               fmi3UnlockPreemptionCallback) {
  return instantiate(__func__, false, name, token, false, environment, logMessage);
}

// Life cycle

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {
  return call(c, __func__, instantiated, [&](Component& k) {
    k.instance.setup(startTime, stopTimeDefined ? stopTime : std::numeric_limits<double>::infinity(),
                     toleranceDefined ? tolerance : 0.0);
    k.enter(initialization, "entered initialization mode");
  });
}

fmi3Status fmi3EnterEventMode(fmi3Instance c) {
  return call(c, __func__, step_complete, [](Component& k) {
    if (!k.event_mode_used) throw std::logic_error("not allowed: it was instantiated with eventModeUsed = false");
    k.enter(event_mode, "entered event mode");
  });
}

fmi3Status fmi3EnterStepMode(fmi3Instance c) {
  return call(c, __func__, event_mode, &Component::enter, step_complete, "entered step mode");
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean* discreteStatesNeedUpdate,
                                    fmi3Boolean* terminateSimulation, fmi3Boolean* nominalsOfContinuousStatesChanged,
                                    fmi3Boolean* valuesOfContinuousStatesChanged, fmi3Boolean* nextEventTimeDefined,
                                    fmi3Float64* nextEventTime) {
  return call(c, __func__, event_mode, [&](Component& k) {
    k.instance.update();
    for (fmi3Boolean* flag : {discreteStatesNeedUpdate, terminateSimulation, nominalsOfContinuousStatesChanged,
                              valuesOfContinuousStatesChanged, nextEventTimeDefined})
      if (flag) *flag = fmi3False;
    if (nextEventTime) *nextEventTime = 0.0;
  });
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean, fmi3Boolean* eventHandlingNeeded, fmi3Boolean* terminateSimulation,
                      fmi3Boolean* earlyReturn, fmi3Float64* lastSuccessfulTime) {
  const fmi3Status status = call(c, __func__, step_complete, [&](Component& k) {
    require_arrays(1, {{eventHandlingNeeded, "eventHandlingNeeded"},
                       {terminateSimulation, "terminateSimulation"},
                       {earlyReturn, "earlyReturn"},
                       {lastSuccessfulTime, "lastSuccessfulTime"}});
    *eventHandlingNeeded = *terminateSimulation = *earlyReturn = fmi3False;
    *lastSuccessfulTime = k.instance.progress.time;
    const auto [size, event] = k.step(currentCommunicationPoint, communicationStepSize, k.early_return_allowed);
    *lastSuccessfulTime = k.instance.progress.time;
    *earlyReturn = size != communicationStepSize;
    *eventHandlingNeeded = event && k.event_mode_used;
    if (event && !k.event_mode_used) k.instance.update();
  });
  if (status == fmi3Discard) *terminateSimulation = static_cast<Component*>(c)->terminate_simulation;
  return status;
}

// Values: of the types that variables have, and of those that none has.

#define SPRINGBEAM_VALUES(type)                                                                                      \
  fmi3Status fmi3Get##type(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3##type values[], size_t m) { \
    return get(c, __func__, vr, n, values, m);                                                                       \
  }                                                                                                                  \
  fmi3Status fmi3Set##type(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3##type values[],       \
                           size_t m) {                                                                               \
    return set(c, __func__, vr, n, values, m);                                                                       \
  }
SPRINGBEAM_VALUES(Float64)
SPRINGBEAM_VALUES(Int32)
SPRINGBEAM_VALUES(Boolean)
#undef SPRINGBEAM_VALUES

#define SPRINGBEAM_NONE_OF(type, get_parameters, set_parameters)                                                     \
  fmi3Status fmi3Get##type get_parameters { return call(c, __func__, any_phase, &Component::refuse_all, n, #type); } \
  fmi3Status fmi3Set##type set_parameters { return call(c, __func__, settable, &Component::refuse_all, n, #type); }
#define SPRINGBEAM_NO_NUMBERS(type)                                                                      \
  SPRINGBEAM_NONE_OF(type, (fmi3Instance c, const fmi3ValueReference[], size_t n, fmi3##type[], size_t), \
                     (fmi3Instance c, const fmi3ValueReference[], size_t n, const fmi3##type[], size_t))
SPRINGBEAM_NO_NUMBERS(Float32)
SPRINGBEAM_NO_NUMBERS(Int8)
SPRINGBEAM_NO_NUMBERS(UInt8)
SPRINGBEAM_NO_NUMBERS(Int16)
SPRINGBEAM_NO_NUMBERS(UInt16)
SPRINGBEAM_NO_NUMBERS(UInt32)
SPRINGBEAM_NO_NUMBERS(Int64)
SPRINGBEAM_NO_NUMBERS(UInt64)
SPRINGBEAM_NO_NUMBERS(String)
SPRINGBEAM_NONE_OF(Binary, (fmi3Instance c, const fmi3ValueReference[], size_t n, size_t[], fmi3Binary[], size_t),
                   (fmi3Instance c, const fmi3ValueReference[], size_t n, const size_t[], const fmi3Binary[], size_t))
SPRINGBEAM_NONE_OF(Clock, (fmi3Instance c, const fmi3ValueReference[], size_t n, fmi3Clock[]),
                   (fmi3Instance c, const fmi3ValueReference[], size_t n, const fmi3Clock[]))
#undef SPRINGBEAM_NO_NUMBERS
#undef SPRINGBEAM_NONE_OF

// Derivatives

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Int32 orders[],
                                    fmi3Float64 values[], size_t m) {
  return call(c, __func__, stepped, [&](Component& k) {
    require_sizes(vr, n, values, m);
    k.output_derivatives(vr, n, orders, values);
  });
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                        const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                        size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity) {
  return call(c, __func__, after_instantiation, [&](Component& k) {
    require_sizes(unknowns, nUnknowns, sensitivity, nSensitivity);
    require_sizes(knowns, nKnowns, seed, nSeed);
    k.directional_derivative(unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity);
  });
}

// What is not provided: the description says so. FMPy also looks for the functions of the other two interfaces.

#define SPRINGBEAM_NOT_PROVIDED(name, ...)                                                              \
  fmi3Status fmi3##name(__VA_ARGS__) {                                                                  \
    return call(c, __func__, any_phase, [](Component&) { throw std::logic_error("is not provided"); }); \
  }
SPRINGBEAM_NOT_PROVIDED(GetNumberOfVariableDependencies, fmi3Instance c, fmi3ValueReference, size_t*)
SPRINGBEAM_NOT_PROVIDED(GetVariableDependencies, fmi3Instance c, fmi3ValueReference, size_t[], fmi3ValueReference[],
                        size_t[], fmi3DependencyKind[], size_t)
SPRINGBEAM_NOT_PROVIDED(GetAdjointDerivative, fmi3Instance c, const fmi3ValueReference[], size_t,
                        const fmi3ValueReference[], size_t, const fmi3Float64[], size_t, fmi3Float64[], size_t)
SPRINGBEAM_NOT_PROVIDED(GetIntervalDecimal, fmi3Instance c, const fmi3ValueReference[], size_t, fmi3Float64[],
                        fmi3IntervalQualifier[])
SPRINGBEAM_NOT_PROVIDED(GetIntervalFraction, fmi3Instance c, const fmi3ValueReference[], size_t, fmi3UInt64[],
                        fmi3UInt64[], fmi3IntervalQualifier[])
SPRINGBEAM_NOT_PROVIDED(GetShiftDecimal, fmi3Instance c, const fmi3ValueReference[], size_t, fmi3Float64[])
SPRINGBEAM_NOT_PROVIDED(GetShiftFraction, fmi3Instance c, const fmi3ValueReference[], size_t, fmi3UInt64[],
                        fmi3UInt64[])
SPRINGBEAM_NOT_PROVIDED(SetIntervalDecimal, fmi3Instance c, const fmi3ValueReference[], size_t, const fmi3Float64[])
SPRINGBEAM_NOT_PROVIDED(SetIntervalFraction, fmi3Instance c, const fmi3ValueReference[], size_t, const fmi3UInt64[],
                        const fmi3UInt64[])
SPRINGBEAM_NOT_PROVIDED(SetShiftDecimal, fmi3Instance c, const fmi3ValueReference[], size_t, const fmi3Float64[])
SPRINGBEAM_NOT_PROVIDED(SetShiftFraction, fmi3Instance c, const fmi3ValueReference[], size_t, const fmi3UInt64[],
                        const fmi3UInt64[])
SPRINGBEAM_NOT_PROVIDED(EvaluateDiscreteStates, fmi3Instance c)
SPRINGBEAM_NOT_PROVIDED(EnterConfigurationMode, fmi3Instance c)
SPRINGBEAM_NOT_PROVIDED(ExitConfigurationMode, fmi3Instance c)
SPRINGBEAM_NOT_PROVIDED(EnterContinuousTimeMode, fmi3Instance c)
SPRINGBEAM_NOT_PROVIDED(CompletedIntegratorStep, fmi3Instance c, fmi3Boolean, fmi3Boolean*, fmi3Boolean*)
SPRINGBEAM_NOT_PROVIDED(SetTime, fmi3Instance c, fmi3Float64)
SPRINGBEAM_NOT_PROVIDED(SetContinuousStates, fmi3Instance c, const fmi3Float64[], size_t)
SPRINGBEAM_NOT_PROVIDED(GetContinuousStateDerivatives, fmi3Instance c, fmi3Float64[], size_t)
SPRINGBEAM_NOT_PROVIDED(GetEventIndicators, fmi3Instance c, fmi3Float64[], size_t)
SPRINGBEAM_NOT_PROVIDED(GetContinuousStates, fmi3Instance c, fmi3Float64[], size_t)
SPRINGBEAM_NOT_PROVIDED(GetNominalsOfContinuousStates, fmi3Instance c, fmi3Float64[], size_t)
SPRINGBEAM_NOT_PROVIDED(GetNumberOfEventIndicators, fmi3Instance c, size_t*)
SPRINGBEAM_NOT_PROVIDED(GetNumberOfContinuousStates, fmi3Instance c, size_t*)
SPRINGBEAM_NOT_PROVIDED(ActivateModelPartition, fmi3Instance c, fmi3ValueReference, fmi3Float64)
#undef SPRINGBEAM_NOT_PROVIDED

}  // extern "C"
