// The FMI 2.0 co-simulation functions over Component. Each states in which phases it may be called (FMI 2.0.4,
// section 4.2.4).
#include <cstddef>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "component.hpp"
#include "description.hpp"
#include "fmi2Functions.h"

namespace {

using fmi::any_phase;
using fmi::Component;
using fmi::require;
using fmi::Status;
using fmi::Type;

// Some importers treat the message as a printf format, some print it as it is: both get a readable text.
void report(const fmi2CallbackFunctions& callbacks, const std::string& name, Status status, const char* category,
            const std::string& message) {
  std::string format;
  for (const char c : message) format += c == '%' ? std::string("%%") : std::string(1, c);
  callbacks.logger(callbacks.componentEnvironment, name.c_str(), static_cast<fmi2Status>(status), category,
                   format.c_str());
}

template <class Body>
fmi2Status guard(fmi2Component c, const char* function, unsigned legal, const Body& body) noexcept {
  if (!c) return fmi2Error;
  Component& component = *static_cast<Component*>(c);
  return static_cast<fmi2Status>(component.guard(function, legal, [&] { body(component); }));
}

/// Made once: it hashes the whole description.
const std::string& guid() {
  static const std::string text = fmi::guid(fmi::table());
  return text;
}

void no_strings(const fmi2ValueReference vr[], size_t n) {
  if (n == 0) return;
  require(vr, "vr");
  throw std::invalid_argument("value reference " + std::to_string(vr[0]) + " is not a String; there are none");
}

}  // namespace

extern "C" {

const char* fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char* fmi2GetVersion(void) { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID, fmi2String,
                              const fmi2CallbackFunctions* functions, fmi2Boolean, fmi2Boolean loggingOn) {
  const auto refuse = [&](const std::string& why) -> fmi2Component {
    if (functions && functions->logger) {
      report(*functions, instanceName ? instanceName : "?", Status::error, "logStatusError", "fmi2Instantiate: " + why);
    }
    return nullptr;
  };
  try {
    if (!instanceName || !*instanceName) return refuse("instanceName is empty");
    if (fmuType != fmi2CoSimulation) return refuse("only co-simulation is provided");
    if (!fmuGUID) return refuse("fmuGUID is NULL");
    if (guid() != fmuGUID) return refuse("fmuGUID = " + std::string(fmuGUID) + " is not that of this FMU, " + guid());
    Component::Logger logger;
    if (functions && functions->logger) {
      // A copy: the importer's struct may be gone after this call.
      logger = [callbacks = *functions, name = std::string(instanceName)](auto... message) {
        report(callbacks, name, message...);
      };
    }
    auto component = std::make_unique<Component>(logger, loggingOn != fmi2False);
    component->log(Status::ok, "logEvents", "instantiated");
    return component.release();
  } catch (const std::exception& e) {
    return refuse(e.what());
  }
}

void fmi2FreeInstance(fmi2Component c) { delete static_cast<Component*>(c); }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[]) {
  std::vector<std::string> unknown;
  const fmi2Status status = guard(c, "fmi2SetDebugLogging", any_phase, [&](Component& k) {
    if (nCategories > 0) require(categories, "categories");
    unknown = k.set_debugging(loggingOn != fmi2False, nCategories, categories);
    for (const std::string& name : unknown) {
      k.log(Status::warning, "logStatusWarning", "fmi2SetDebugLogging: there is no log category '" + name + "'");
    }
  });
  return unknown.empty() ? status : fmi2Warning;
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
    k.instance.enter_initialization();
    k.log(Status::ok, "logEvents", "entered initialization mode");
  });
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
  return guard(c, "fmi2ExitInitializationMode", fmi::initialization, [](Component& k) {
    k.instance.exit_initialization();
    k.log(Status::ok, "logEvents", "initialized");
  });
}

fmi2Status fmi2Terminate(fmi2Component c) {
  return guard(c, "fmi2Terminate", fmi::step_complete, [](Component& k) {
    k.instance.terminate();
    k.log(Status::ok, "logEvents", "terminated");
  });
}

fmi2Status fmi2Reset(fmi2Component c) {
  return guard(c, "fmi2Reset", any_phase, [](Component& k) {
    k.instance.reset();
    k.log(Status::ok, "logEvents", "reset");
  });
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]) {
  return guard(c, "fmi2GetReal", any_phase, [&](Component& k) { k.get(vr, nvr, value, Type::real); });
}
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[]) {
  return guard(c, "fmi2GetInteger", any_phase, [&](Component& k) { k.get(vr, nvr, value, Type::integer); });
}
fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[]) {
  return guard(c, "fmi2GetBoolean", any_phase, [&](Component& k) { k.get(vr, nvr, value, Type::boolean); });
}
fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String[]) {
  return guard(c, "fmi2GetString", any_phase, [&](Component&) { no_strings(vr, nvr); });
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]) {
  return guard(c, "fmi2SetReal", fmi::settable, [&](Component& k) { k.set(vr, nvr, value, Type::real); });
}
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[]) {
  return guard(c, "fmi2SetInteger", fmi::settable, [&](Component& k) { k.set(vr, nvr, value, Type::integer); });
}
fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[]) {
  return guard(c, "fmi2SetBoolean", fmi::settable, [&](Component& k) { k.set(vr, nvr, value, Type::boolean); });
}
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String[]) {
  return guard(c, "fmi2SetString", fmi::settable, [&](Component&) { no_strings(vr, nvr); });
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate* FMUstate) {
  return guard(c, "fmi2GetFMUstate", any_phase, [&](Component& k) {
    require(FMUstate, "FMUstate");
    if (!*FMUstate) *FMUstate = k.keep({});
    k.instance.save(k.state(*FMUstate));
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
    if (nUnknown == 0) return;
    require(vUnknown_ref, "vUnknown_ref");
    require(dvUnknown, "dvUnknown");
    if (nKnown > 0) require(vKnown_ref, "vKnown_ref");
    if (nKnown > 0) require(dvKnown, "dvKnown");
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
    if (nvr == 0) return;
    require(vr, "vr");
    require(order, "order");
    require(value, "value");
    for (size_t i = 0; i < nvr; ++i) k.instance.set_derivative(vr[i], order[i], value[i]);
  });
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[]) {
  return guard(c, "fmi2GetRealOutputDerivatives", fmi::stepped, [&](Component& k) {
    if (nvr == 0) return;
    require(vr, "vr");
    require(order, "order");
    require(value, "value");
    for (size_t i = 0; i < nvr; ++i) value[i] = k.instance.output_derivative(vr[i], order[i]);
  });
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean) {
  const fmi2Status status = guard(c, "fmi2DoStep", fmi::step_complete, [&](Component& k) {
    k.instance.step(currentCommunicationPoint, communicationStepSize);
    // Only told: the step is done, and some masters stop at any status but fmi2OK.
    const std::string warning = k.instance.take_warning();
    if (!warning.empty()) k.log(Status::warning, "logStatusWarning", "fmi2DoStep: " + warning);
  });
  if (c) static_cast<Component*>(c)->instance.last_status = status;
  return status;
}

fmi2Status fmi2CancelStep(fmi2Component c) {
  return guard(c, "fmi2CancelStep", 0, [](Component&) {});  // no step is ever in progress
}

// Strictly the status functions belong to a step in progress or failed; asking after a completed one does no harm.
fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status* value) {
  return guard(c, "fmi2GetStatus", fmi::stepped, [&](Component& k) {
    require(value, "value");
    if (s != fmi2DoStepStatus) throw fmi::Discarded("only fmi2DoStepStatus is a status");
    *value = static_cast<fmi2Status>(k.instance.last_status);
  });
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real* value) {
  return guard(c, "fmi2GetRealStatus", fmi::stepped, [&](Component& k) {
    require(value, "value");
    if (s != fmi2LastSuccessfulTime) throw fmi::Discarded("only fmi2LastSuccessfulTime is a Real");
    *value = k.instance.time();
  });
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind, fmi2Integer* value) {
  return guard(c, "fmi2GetIntegerStatus", fmi::stepped, [&](Component&) {
    require(value, "value");
    throw fmi::Discarded("no status is an Integer");
  });
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean* value) {
  return guard(c, "fmi2GetBooleanStatus", fmi::stepped, [&](Component&) {
    require(value, "value");
    if (s != fmi2Terminated) throw fmi::Discarded("only fmi2Terminated is a Boolean");
    *value = fmi2False;  // the slave never ends a simulation by itself
  });
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String* value) {
  return guard(c, "fmi2GetStringStatus", fmi::stepped, [&](Component&) {
    require(value, "value");
    if (s != fmi2PendingStatus) throw fmi::Discarded("only fmi2PendingStatus is a String");
    *value = "no step is pending";
  });
}

}  // extern "C"
