// What stands behind an fmi2Component: an instance with its messages and its saved states, and the guard that turns C++
// exceptions into a status and a message.
#pragma once

#include <cstddef>
#include <exception>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>

#include "fmi2Functions.h"
#include "instance.hpp"

namespace fmi {

constexpr unsigned any_phase = instantiated | initialization | step_complete | terminated | error;
constexpr unsigned after_instantiation = any_phase & ~static_cast<unsigned>(instantiated);
constexpr unsigned stepped = step_complete | terminated | error;
// Inputs are accepted before initialization too: several importers set them there.
constexpr unsigned settable = instantiated | initialization | step_complete;

/// @throws std::invalid_argument
inline void require(const void* pointer, const char* what) {
  if (!pointer) throw std::invalid_argument(std::string(what) + " is NULL");
}

class Component {
 public:
  /// `functions` may be NULL, and gone after the call.
  Component(const fmi2CallbackFunctions* functions, const char* name, bool log_events);

  Instance instance;

  /// Events, with fmi2OK, are sent if debugging is on for them; warnings and failures always.
  void log(fmi2Status status, const char* category, const std::string& message) const;
  /// No category: all of them. Returns whether all of them exist; a warning names each that does not.
  bool set_debugging(bool on, std::size_t n, const fmi2String categories[]);

  /// @throws std::invalid_argument if the state was not made by this instance, or is already freed
  Snapshot& state(fmi2FMUstate key);
  fmi2FMUstate keep(Snapshot snapshot);
  /// Save the instance into the state of `key`, or a new one if it is NULL. If that fails, nothing has changed.
  void save(fmi2FMUstate& key);
  void free_state(fmi2FMUstate key);

  const char* phase_text() const;
  /// Reports and enters the phase `error`.
  fmi2Status fail(const char* function, const char* why);

 private:
  const fmi2CallbackFunctions callbacks_;
  const std::string name_;
  bool events_;  ///< whether they are logged
  std::map<fmi2FMUstate, std::unique_ptr<Snapshot>> states_;
  Snapshot spare_;  ///< of the last save, whose memory the next one uses
};

/// Runs `body(component)`, which may throw, if the instance is in one of the `legal` phases.
template <class Body>
fmi2Status guard(fmi2Component c, const char* function, unsigned legal, const Body& body) noexcept {
  if (!c) return fmi2Error;
  Component& component = *static_cast<Component*>(c);
  Phase& phase = component.instance.progress.phase;
  try {
    try {
      if ((phase & legal) == 0) throw std::logic_error(std::string("not allowed ") + component.phase_text());
      body(component);
      return fmi2OK;
    } catch (const Discarded& e) {
      component.log(fmi2Discard, "logStatusDiscard", std::string(function) + ": " + e.what());
      return fmi2Discard;
    } catch (const std::exception& e) {
      return component.fail(function, e.what());
    } catch (...) {
      return component.fail(function, "unknown exception");
    }
  } catch (...) {  // out of memory while reporting
    phase = error;
    return fmi2Error;
  }
}

}  // namespace fmi
