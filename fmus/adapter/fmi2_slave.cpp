// The FMI 2.0 co-simulation functions over Instance. Each states in which phases it may be called (FMI 2.0.4,
// section 4.2.4); one guard turns C++ exceptions into a status and a message.
#include <algorithm>
#include <exception>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>

#include "description.hpp"
#include "fmi2Functions.h"
#include "instance.hpp"

namespace {

using fmi::Phase;
using fmi::Snapshot;
using fmi::Unavailable;

constexpr unsigned any_phase =
    fmi::instantiated | fmi::initialization | fmi::step_complete | fmi::step_failed | fmi::terminated | fmi::error;
constexpr unsigned after_instantiation = any_phase & ~static_cast<unsigned>(fmi::instantiated);
// Inputs are accepted before initialization too: several importers set them there.
constexpr unsigned settable = fmi::instantiated | fmi::initialization | fmi::step_complete;

// Some importers treat the message as a printf format, some print it as it is: both get a readable text.
void report(const fmi2CallbackFunctions& callbacks, const char* name, fmi2Status status, const char* category,
            const std::string& message) {
  std::string format;
  for (char c : message) format += c == '%' ? std::string("%%") : std::string(1, c);
  callbacks.logger(callbacks.componentEnvironment, name, status, category, format.c_str());
}

struct Component {
  std::string name;
  fmi2CallbackFunctions callbacks{};  // a copy: the importer's struct may be gone after fmi2Instantiate
  bool debug = false;
  std::set<std::string> categories;  // switched on for debugging
  fmi::Instance instance;
  std::map<fmi2FMUstate, std::unique_ptr<Snapshot>> states;

  void log(fmi2Status status, const char* category, const std::string& message) const {
    if (!callbacks.logger) return;
    if (status == fmi2OK && !(debug && (categories.count(category) || categories.count("logAll")))) return;
    report(callbacks, name.c_str(), status, category, message);
  }

  Snapshot& state(fmi2FMUstate key) {
    const auto found = states.find(key);
    if (found == states.end()) {
      throw std::invalid_argument("the FMU state was not made by this instance, or is already freed");
    }
    return *found->second;
  }

  fmi2FMUstate keep(Snapshot snapshot) {
    auto owned = std::make_unique<Snapshot>(std::move(snapshot));
    const fmi2FMUstate key = owned.get();
    states[key] = std::move(owned);
    return key;
  }
};

template <class Body>
fmi2Status guard(fmi2Component c, const char* function, unsigned legal, Body body) noexcept {
  if (!c) return fmi2Error;
  Component& component = *static_cast<Component*>(c);
  const auto fail = [&](const char* why) {
    component.log(fmi2Error, "logStatusError", std::string(function) + ": " + why);
    component.instance.phase = fmi::error;
    return fmi2Error;
  };
  try {
    try {
      if ((component.instance.phase & legal) == 0) {
        const char* phase = "?";
        switch (component.instance.phase) {
          case fmi::instantiated:
            phase = "before initialization";
            break;
          case fmi::initialization:
            phase = "in initialization mode";
            break;
          case fmi::step_complete:
            phase = "between steps";
            break;
          case fmi::step_failed:
            phase = "after a discarded step (restore a state or reset first)";
            break;
          case fmi::terminated:
            phase = "after fmi2Terminate";
            break;
          case fmi::error:
            phase = "after an error (restore a state or reset first)";
            break;
        }
        throw std::logic_error(std::string("not allowed ") + phase);
      }
      body(component);
      return fmi2OK;
    } catch (const Unavailable& e) {
      component.log(fmi2Discard, "logStatusDiscard", std::string(function) + ": " + e.what());
      return fmi2Discard;
    } catch (const fmi::StepDiscarded& e) {
      component.instance.phase = fmi::step_failed;
      component.log(fmi2Discard, "logStatusDiscard", std::string(function) + ": " + e.what());
      return fmi2Discard;
    } catch (const std::exception& e) {
      return fail(e.what());
    } catch (...) {
      return fail("unknown exception");
    }
  } catch (...) {  // out of memory while reporting
    component.instance.phase = fmi::error;
    return fmi2Error;
  }
}

/// Made once: it hashes the whole description.
const std::string& guid() {
  static const std::string text = fmi::guid(fmi::table());
  return text;
}

void require(const void* pointer, const char* what) {
  if (!pointer) throw std::invalid_argument(std::string(what) + " is NULL");
}

template <class Value>
void get_values(Component& k, const fmi2ValueReference vr[], size_t n, Value values[], fmi::Type type) {
  if (n == 0) return;
  require(vr, "vr");
  require(values, "value");
  for (size_t i = 0; i < n; ++i) values[i] = static_cast<Value>(k.instance.get(vr[i], type));
}

template <class Value>
void set_values(Component& k, const fmi2ValueReference vr[], size_t n, const Value values[], fmi::Type type) {
  if (n == 0) return;
  require(vr, "vr");
  require(values, "value");
  for (size_t i = 0; i < n; ++i) {
    const bool boolean = type == fmi::Type::boolean;
    k.instance.set(vr[i], type, boolean ? (values[i] != 0 ? 1.0 : 0.0) : static_cast<double>(values[i]));
  }
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
      report(*functions, instanceName ? instanceName : "?", fmi2Error, "logStatusError", "fmi2Instantiate: " + why);
    }
    return nullptr;
  };
  try {
    if (!instanceName || !*instanceName) return refuse("instanceName is empty");
    if (fmuType != fmi2CoSimulation) return refuse("only co-simulation is provided");
    if (!fmuGUID) return refuse("fmuGUID is NULL");
    if (guid() != fmuGUID) return refuse("fmuGUID = " + std::string(fmuGUID) + " is not that of this FMU, " + guid());
    auto component = std::make_unique<Component>();
    component->name = instanceName;
    if (functions) component->callbacks = *functions;
    component->debug = loggingOn != fmi2False;
    for (const auto& category : fmi::log_categories) component->categories.insert(category.name);
    component->log(fmi2OK, "logEvents", "instantiated");
    return component.release();
  } catch (const std::exception& e) {
    return refuse(e.what());
  }
}

void fmi2FreeInstance(fmi2Component c) { delete static_cast<Component*>(c); }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[]) {
  bool unknown = false;
  const fmi2Status status = guard(c, "fmi2SetDebugLogging", any_phase, [&](Component& k) {
    if (nCategories > 0) require(categories, "categories");
    std::set<std::string> chosen;
    for (size_t i = 0; i < nCategories; ++i) {
      require(categories[i], "a category");
      const std::string name = categories[i];
      const auto same = [&](const fmi::LogCategory& known) { return name == known.name; };
      if (std::any_of(std::begin(fmi::log_categories), std::end(fmi::log_categories), same)) {
        chosen.insert(name);
      } else {
        unknown = true;
        k.log(fmi2Warning, "logStatusWarning", "fmi2SetDebugLogging: there is no log category '" + name + "'");
      }
    }
    if (nCategories == 0) {  // all of them
      for (const auto& category : fmi::log_categories) chosen.insert(category.name);
    }
    k.debug = loggingOn != fmi2False;
    k.categories = chosen;
  });
  return status == fmi2OK && unknown ? fmi2Warning : status;
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
  return guard(c, "fmi2Terminate", fmi::step_complete | fmi::step_failed, [](Component& k) {
    k.instance.terminate();
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
  return guard(c, "fmi2GetReal", any_phase, [&](Component& k) { get_values(k, vr, nvr, value, fmi::Type::real); });
}
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[]) {
  return guard(c, "fmi2GetInteger", any_phase,
               [&](Component& k) { get_values(k, vr, nvr, value, fmi::Type::integer); });
}
fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[]) {
  return guard(c, "fmi2GetBoolean", any_phase,
               [&](Component& k) { get_values(k, vr, nvr, value, fmi::Type::boolean); });
}
fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String[]) {
  return guard(c, "fmi2GetString", any_phase, [&](Component&) { no_strings(vr, nvr); });
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]) {
  return guard(c, "fmi2SetReal", settable, [&](Component& k) { set_values(k, vr, nvr, value, fmi::Type::real); });
}
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[]) {
  return guard(c, "fmi2SetInteger", settable, [&](Component& k) { set_values(k, vr, nvr, value, fmi::Type::integer); });
}
fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[]) {
  return guard(c, "fmi2SetBoolean", settable, [&](Component& k) { set_values(k, vr, nvr, value, fmi::Type::boolean); });
}
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String[]) {
  return guard(c, "fmi2SetString", settable, [&](Component&) { no_strings(vr, nvr); });
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
    k.state(*FMUstate);
    k.states.erase(*FMUstate);
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
    const Snapshot& snapshot = k.state(FMUstate);
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
    *FMUstate = k.keep(fmi::deserialize(serializedState, size, guid(), fmi::table().variables.size()));
  });
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference[], size_t, const fmi2ValueReference[],
                                        size_t, const fmi2Real[], fmi2Real[]) {
  return guard(c, "fmi2GetDirectionalDerivative", after_instantiation,
               [](Component&) { throw std::logic_error("not provided (providesDirectionalDerivative=\"false\")"); });
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[]) {
  return guard(c, "fmi2SetRealInputDerivatives", settable, [&](Component& k) {
    if (nvr == 0) return;
    require(vr, "vr");
    require(order, "order");
    require(value, "value");
    for (size_t i = 0; i < nvr; ++i) k.instance.set_derivative(vr[i], order[i], value[i]);
  });
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[]) {
  constexpr unsigned legal = fmi::step_complete | fmi::step_failed | fmi::terminated | fmi::error;
  return guard(c, "fmi2GetRealOutputDerivatives", legal, [&](Component& k) {
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
    if (!warning.empty()) k.log(fmi2Warning, "logStatusWarning", "fmi2DoStep: " + warning);
  });
  if (c) static_cast<Component*>(c)->instance.last_status = status;
  return status;
}

fmi2Status fmi2CancelStep(fmi2Component c) {
  return guard(c, "fmi2CancelStep", 0, [](Component&) {});  // no step is ever in progress
}

// Strictly these belong to a step in progress or failed; asking after a completed one does no harm.
constexpr unsigned status_known = fmi::step_complete | fmi::step_failed | fmi::terminated | fmi::error;

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status* value) {
  return guard(c, "fmi2GetStatus", status_known, [&](Component& k) {
    require(value, "value");
    if (s != fmi2DoStepStatus) throw Unavailable("only fmi2DoStepStatus is a status");
    *value = static_cast<fmi2Status>(k.instance.last_status);
  });
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real* value) {
  return guard(c, "fmi2GetRealStatus", status_known, [&](Component& k) {
    require(value, "value");
    if (s != fmi2LastSuccessfulTime) throw Unavailable("only fmi2LastSuccessfulTime is a Real");
    *value = k.instance.time();
  });
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind, fmi2Integer* value) {
  return guard(c, "fmi2GetIntegerStatus", status_known, [&](Component&) {
    require(value, "value");
    throw Unavailable("no status is an Integer");
  });
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean* value) {
  return guard(c, "fmi2GetBooleanStatus", status_known, [&](Component&) {
    require(value, "value");
    if (s != fmi2Terminated) throw Unavailable("only fmi2Terminated is a Boolean");
    *value = fmi2False;  // the slave never ends a simulation by itself
  });
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String* value) {
  return guard(c, "fmi2GetStringStatus", status_known, [&](Component&) {
    require(value, "value");
    if (s != fmi2PendingStatus) throw Unavailable("only fmi2PendingStatus is a String");
    *value = "no step is pending";
  });
}

}  // extern "C"
