// What stands behind an fmi2Component or fmi3Instance: an instance with its messages and its saved states, the guard
// that turns C++ exceptions into a status and a message, and the calls that both versions of FMI have. No FMI types.
#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "instance.hpp"

namespace fmi {

/// As fmi2Status and fmi3Status are numbered.
enum class Status { ok, warning, discard, error };

constexpr unsigned any_phase = instantiated | initialization | step_complete | event_mode | terminated | error;
constexpr unsigned after_instantiation = any_phase & ~static_cast<unsigned>(instantiated);
constexpr unsigned running = step_complete | event_mode;
constexpr unsigned stepped = running | terminated | error;
// Inputs are accepted before initialization too: several importers set them there.
constexpr unsigned settable = instantiated | initialization | running;

/// @throws std::invalid_argument
inline void require(const void* pointer, const char* what) {
  if (!pointer) throw std::invalid_argument(std::string(what) + " is NULL");
}

/// @throws std::invalid_argument if one of the arrays of `n` values is missing
inline void require_arrays(std::size_t n, std::initializer_list<std::pair<const void*, const char*>> arrays) {
  if (n == 0) return;
  for (const auto& [array, name] : arrays) require(array, name);
}

/// Takes a message: its status, its category and its text.
using Log = std::function<void(Status, const char*, const std::string&)>;

class Component {
 public:
  Component(Log log, bool log_events) : log_events(log_events), log_(std::move(log)) {}

  Instance instance;
  bool log_events;
  std::map<void*, std::unique_ptr<Snapshot>> states;
  Snapshot spare;  ///< of the last save, whose memory the next one uses

  /// Events, with Status::ok, are sent if debugging is on for them; warnings and failures always.
  void log(Status status, const char* category, const std::string& message) const {
    if (log_ && (status != Status::ok || log_events)) log_(status, category, message);
  }
  void note(const char* event) const { log(Status::ok, "logEvents", event); }
  /// Enters a phase, which is told as `event`.
  void enter(Phase phase, const char* event);
  /// A step of the instance. The model's warning is told, no more: the step is done, and some masters stop at any
  /// status but OK.
  Model::Reached step(const char* function, double time, double size, bool to_event = false);
  /// @throws std::invalid_argument if the state was not made by this instance, or is already freed
  Snapshot& state(void* key);
  void* keep(Snapshot snapshot);
  const char* phase_text() const;
  /// Reports and enters the phase `error`.
  Status fail(const char* function, const char* why);

 private:
  const Log log_;
};

/// Runs `body(component)`, which may throw, if the instance is in one of the `legal` phases.
template <class Body>
Status guard(void* c, const char* function, unsigned legal, const Body& body) noexcept {
  if (!c) return Status::error;
  Component& component = *static_cast<Component*>(c);
  Phase& phase = component.instance.progress.phase;
  try {
    try {
      if ((phase & legal) == 0) throw std::logic_error(std::string("not allowed ") + component.phase_text());
      body(component);
      return Status::ok;
    } catch (const Discarded& e) {
      component.log(Status::discard, "logStatusDiscard", std::string(function) + ": " + e.what());
      return Status::discard;
    } catch (const std::exception& e) {
      return component.fail(function, e.what());
    }
  } catch (...) {  // out of memory while reporting, or what is no std::exception
    phase = error;
    return Status::error;
  }
}

// What both versions of FMI have, by the name that `function` has there.

/// Whether `c` may stay: the instance has a name, and `identity` is the description's.
Status instantiate(Component* c, const char* function, const char* name, const char* identity);
/// No category: all of them. A warning names each that does not exist.
Status set_debugging(void* c, const char* function, bool on, std::size_t n, const char* const categories[]);
Status reset(void* c, const char* function);
/// Of variables of a type that there are none of.
Status none_of(void* c, const char* function, unsigned legal, std::size_t n, const char* type);
/// Into the state that `*state` names, or a new one if it is NULL.
Status get_state(void* c, const char* function, void** state);
Status set_state(void* c, const char* function, void* state);
Status free_state(void* c, const char* function, void** state);
Status state_size(void* c, const char* function, void* state, std::size_t* size);
Status serialize_state(void* c, const char* function, void* state, void* bytes, std::size_t size);
Status deserialize_state(void* c, const char* function, const void* bytes, std::size_t size, void** state);
Status output_derivatives(void* c, const char* function, const unsigned references[], std::size_t n, const int orders[],
                          double values[]);
/// One unknown's derivative in the direction `seed` of the knowns, for each unknown.
Status directional_derivative(void* c, const char* function, const unsigned unknowns[], std::size_t n_unknowns,
                              const unsigned knowns[], std::size_t n_knowns, const double seed[], double sensitivity[]);

}  // namespace fmi
