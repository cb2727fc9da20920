// The FMI 2.0 co-simulation functions over Component. Each states in which phases it may be called (FMI 2.0.4,
// section 4.2.4).
#include <cstddef>
#include <initializer_list>
#include <limits>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>

#include "component.hpp"
#include "description.hpp"

namespace {

using fmi::any_phase;
using fmi::Component;
using fmi::guard;
using fmi::guid;
using fmi::Progress;
using fmi::require;
using fmi::Type;

/// @throws std::invalid_argument if one of the arrays of `n` values is missing
void require_arrays(size_t n, std::initializer_list<std::pair<const void*, const char*>> arrays) {
  if (n == 0) return;
  for (const auto& [array, name] : arrays) require(array, name);
}

template <class Value>
fmi2Status get(fmi2Component c, const char* function, const fmi2ValueReference vr[], size_t n, Value values[],
               Type type) {
  return guard(c, function, any_phase, [&](Component& k) {
    require_arrays(n, {{vr, "vr"}, {values, "value"}});
    for (size_t i = 0; i < n; ++i) values[i] = static_cast<Value>(k.instance.get(vr[i], type));
  });
}

template <class Value>
fmi2Status set(fmi2Component c, const char* function, const fmi2ValueReference vr[], size_t n, const Value values[],
               Type type) {
  return guard(c, function, fmi::settable, [&](Component& k) {
    require_arrays(n, {{vr, "vr"}, {values, "value"}});
    for (size_t i = 0; i < n; ++i) {
      k.instance.set(vr[i], type, static_cast<double>(type == Type::boolean ? Value(values[i] != 0) : values[i]));
    }
  });
}

fmi2Status no_strings(fmi2Component c, const char* function, unsigned legal, const fmi2ValueReference vr[], size_t n) {
  return guard(c, function, legal, [&](Component&) {
    if (n == 0) return;
    require(vr, "vr");
    throw std::invalid_argument("value reference " + std::to_string(vr[0]) + " is not a String; there are none");
  });
}

/// Strictly the status functions belong to a step in progress or failed; asking after a completed one does no harm.
template <class Value, class Get>
fmi2Status get_status(fmi2Component c, const char* function, bool known, const char* why_not, Value* value,
                      const Get& status_of) {
  return guard(c, function, fmi::stepped, [&](Component& k) {
    require(value, "value");
    if (!known) throw fmi::Discarded(why_not);
    *value = status_of(k.instance.progress);
  });
}

}  // namespace

extern "C" {

const char* fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char* fmi2GetVersion(void) { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID, fmi2String,
                              const fmi2CallbackFunctions* functions, fmi2Boolean, fmi2Boolean loggingOn) {
  std::unique_ptr<Component> component;
  try {
    component = std::make_unique<Component>(functions, instanceName ? instanceName : "?", loggingOn != fmi2False);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
  const auto status = guard(component.get(), "fmi2Instantiate", fmi::instantiated, [&](Component& k) {
    if (!instanceName || !*instanceName) throw std::invalid_argument("instanceName is empty");
    if (fmuType != fmi2CoSimulation) throw std::invalid_argument("only co-simulation is provided");
    require(fmuGUID, "fmuGUID");
    if (guid() != fmuGUID) {
      throw std::invalid_argument("fmuGUID = " + std::string(fmuGUID) + " is not that of this FMU, " + guid());
    }
    k.log(fmi2OK, "logEvents", "instantiated");
  });
  return status == fmi2OK ? component.release() : nullptr;
}

void fmi2FreeInstance(fmi2Component c) { delete static_cast<Component*>(c); }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[]) {
  bool all_known = true;
  const fmi2Status status = guard(c, "fmi2SetDebugLogging", any_phase, [&](Component& k) {
    require_arrays(nCategories, {{categories, "categories"}});
    all_known = k.set_debugging(loggingOn != fmi2False, nCategories, categories);
  });
  return all_known ? status : fmi2Warning;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
  return guard(c, "fmi2SetupExperiment", fmi::instantiated, [&](Component& k) {
    const bool usable = toleranceDefined && tolerance > 0.0 && tolerance < 1.0;
    k.instance.setup(startTime, stopTimeDefined ? stopTime : std::numeric_limits<double>::infinity(),
                     usable ? tolerance : 0.0);
  });
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
  return guard(c, "fmi2EnterInitializationMode", fmi::instantiated, [](Component& k) {
    k.instance.progress.phase = fmi::initialization;
    k.log(fmi2OK, "logEvents", "entered initialization mode");
  });
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
  return guard(c, "fmi2ExitInitializationMode", fmi::initialization, [](Component& k) {
    k.instance.exit_initialization();
    k.log(fmi2OK, "logEvents", "initialized");
  });
}

fmi2Status fmi2Terminate(fmi2Component c) {
  return guard(c, "fmi2Terminate", fmi::step_complete, [](Component& k) {
    k.instance.progress.phase = fmi::terminated;
    k.log(fmi2OK, "logEvents", "terminated");
  });
}

fmi2Status fmi2Reset(fmi2Component c) {
  return guard(c, "fmi2Reset", any_phase, [](Component& k) {
    k.instance.reset();
    k.log(fmi2OK, "logEvents", "reset");
  });
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]) {
  return get(c, "fmi2GetReal", vr, nvr, value, Type::real);
}
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[]) {
  return get(c, "fmi2GetInteger", vr, nvr, value, Type::integer);
}
fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[]) {
  return get(c, "fmi2GetBoolean", vr, nvr, value, Type::boolean);
}
fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String[]) {
  return no_strings(c, "fmi2GetString", any_phase, vr, nvr);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]) {
  return set(c, "fmi2SetReal", vr, nvr, value, Type::real);
}
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[]) {
  return set(c, "fmi2SetInteger", vr, nvr, value, Type::integer);
}
fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[]) {
  return set(c, "fmi2SetBoolean", vr, nvr, value, Type::boolean);
}
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String[]) {
  return no_strings(c, "fmi2SetString", fmi::settable, vr, nvr);
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate* FMUstate) {
  return guard(c, "fmi2GetFMUstate", any_phase, [&](Component& k) {
    require(FMUstate, "FMUstate");
    k.save(*FMUstate);
  });
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate) {
  return guard(c, "fmi2SetFMUstate", any_phase, [&](Component& k) {
    require(FMUstate, "FMUstate");
    k.instance.restore(k.state(FMUstate));
  });
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate* FMUstate) {
  return guard(c, "fmi2FreeFMUstate", any_phase, [&](Component& k) {
    if (!FMUstate || !*FMUstate) return;
    k.free_state(*FMUstate);
    *FMUstate = nullptr;
  });
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t* size) {
  return guard(c, "fmi2SerializedFMUstateSize", any_phase, [&](Component& k) {
    require(size, "size");
    *size = fmi::serialized_size(k.state(FMUstate));
  });
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size) {
  return guard(c, "fmi2SerializeFMUstate", any_phase, [&](Component& k) {
    require(serializedState, "serializedState");
    const fmi::Snapshot& snapshot = k.state(FMUstate);
    const size_t needed = fmi::serialized_size(snapshot);
    if (size < needed) {
      throw std::invalid_argument("size = " + std::to_string(size) + ", needed are " + std::to_string(needed));
    }
    fmi::serialize(snapshot, guid(), serializedState);
  });
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size,
                                   fmi2FMUstate* FMUstate) {
  return guard(c, "fmi2DeSerializeFMUstate", any_phase, [&](Component& k) {
    require(serializedState, "serializedState");
    require(FMUstate, "FMUstate");
    // Purely an output, unlike fmi2GetFMUstate's: importers leave anything in it.
    *FMUstate = k.keep(fmi::deserialize(serializedState, size, guid(), k.instance.n_settings(), k.instance.n_inputs()));
  });
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown, const fmi2Real dvKnown[],
                                        fmi2Real dvUnknown[]) {
  return guard(c, "fmi2GetDirectionalDerivative", fmi::after_instantiation, [&](Component& k) {
    require_arrays(nUnknown, {{vUnknown_ref, "vUnknown_ref"}, {dvUnknown, "dvUnknown"}});
    require_arrays(nKnown, {{vKnown_ref, "vKnown_ref"}, {dvKnown, "dvKnown"}});
    for (size_t i = 0; i < nUnknown; ++i) {
      double sum = 0.0;
      for (size_t j = 0; j < nKnown; ++j) {
        sum += k.instance.partial_derivative(vUnknown_ref[i], vKnown_ref[j]) * dvKnown[j];
      }
      dvUnknown[i] = sum;
    }
  });
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[]) {
  return guard(c, "fmi2SetRealInputDerivatives", fmi::settable, [&](Component& k) {
    require_arrays(nvr, {{vr, "vr"}, {order, "order"}, {value, "value"}});
    for (size_t i = 0; i < nvr; ++i) k.instance.set_derivative(vr[i], order[i], value[i]);
  });
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[]) {
  return guard(c, "fmi2GetRealOutputDerivatives", fmi::stepped, [&](Component& k) {
    require_arrays(nvr, {{vr, "vr"}, {order, "order"}, {value, "value"}});
    for (size_t i = 0; i < nvr; ++i) value[i] = k.instance.output_derivative(vr[i], order[i]);
  });
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean) {
  const fmi2Status status = guard(c, "fmi2DoStep", fmi::step_complete, [&](Component& k) {
    k.instance.step(currentCommunicationPoint, communicationStepSize);
    // Only told: the step is done, and some masters stop at any status but fmi2OK.
    const std::string warning = k.instance.take_warning();
    if (!warning.empty()) k.log(fmi2Warning, "logStatusWarning", "fmi2DoStep: " + warning);
  });
  if (c) static_cast<Component*>(c)->instance.progress.last_status = status;
  return status;
}

fmi2Status fmi2CancelStep(fmi2Component c) {
  return guard(c, "fmi2CancelStep", 0, [](Component&) {});  // no step is ever in progress
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status* value) {
  return get_status(c, "fmi2GetStatus", s == fmi2DoStepStatus, "only fmi2DoStepStatus is a status", value,
                    [](const Progress& p) { return static_cast<fmi2Status>(p.last_status); });
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real* value) {
  return get_status(c, "fmi2GetRealStatus", s == fmi2LastSuccessfulTime, "only fmi2LastSuccessfulTime is a Real", value,
                    [](const Progress& p) { return p.time; });
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind, fmi2Integer* value) {
  return get_status(c, "fmi2GetIntegerStatus", false, "no status is an Integer", value,
                    [](const Progress&) { return 0; });
}

// The slave never ends a simulation by itself.
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean* value) {
  return get_status(c, "fmi2GetBooleanStatus", s == fmi2Terminated, "only fmi2Terminated is a Boolean", value,
                    [](const Progress&) { return fmi2False; });
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String* value) {
  return get_status(c, "fmi2GetStringStatus", s == fmi2PendingStatus, "only fmi2PendingStatus is a String", value,
                    [](const Progress&) { return "no step is pending"; });
}

}  // extern "C"
