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

/// Arguments that are missing or wrong throw std::invalid_argument.
class Component {
 public:
  Component(Log log, bool log_events, const TypeNames& names)
      : instance(names), log_(std::move(log)), log_events_(log_events) {}

  Instance instance;
  bool event_mode_used = false, early_return_allowed = false;  ///< what the importer can do (FMI 3.0)
  const char* function = "";                                   ///< of FMI, that is being called
  bool terminate_simulation = false;                           ///< no step of any size can follow the last one

  /// Sends a message. Events, with Status::ok, are sent if debugging is on for them; the rest always, with the
  /// function's name. After an error the instance is in the phase `error`.
  Status report(Status status, const std::string& what);
  /// Enters a phase, which is reported as `event`.
  void enter(Phase phase, const char* event);
  const char* phase_text() const;

  /// No category: all of them. A warning names each that does not exist.
  void set_debugging(bool on, std::size_t n, const char* const categories[]);
  void start();  ///< the end of initialization mode
  void reset();
  /// A step of the instance. The model's warning is reported, no more: the step is done, and some masters stop at any
  /// status but OK.
  Reached step(double time, double size, bool to_event = false);

  /// Into the state that `*state` names, or a new one if it is NULL.
  void get_state(void** state);
  void set_state(void* state);
  void free_state(void** state);
  void state_size(void* state, std::size_t* size);
  void serialize(void* state, void* bytes, std::size_t size);
  void deserialize(const void* bytes, std::size_t size, void** state);

  /// Of variables of a type that there are none of.
  void refuse_all(std::size_t n, const char* type) const;
  void output_derivatives(const unsigned references[], std::size_t n, const int orders[], double values[]);
  /// One unknown's derivative in the direction `seed` of the knowns, for each unknown.
  void directional_derivative(const unsigned unknowns[], std::size_t n_unknowns, const unsigned knowns[],
                              std::size_t n_knowns, const double seed[], double sensitivity[]);

 private:
  Snapshot& found(void* state);
  void* keep(Snapshot snapshot);

  const Log log_;
  bool log_events_;
  std::map<void*, std::unique_ptr<Snapshot>> states_;
  Snapshot spare_;  ///< of the last save, whose memory the next one uses
};

/// Runs `body(component)`, which may throw, if the instance is in one of the `legal` phases.
template <class Body>
Status guard(void* c, const char* function, unsigned legal, const Body& body) noexcept {
  if (!c) return Status::error;
  Component& component = *static_cast<Component*>(c);
  Phase& phase = component.instance.progress.phase;
  component.function = function;
  try {
    try {
      if ((phase & legal) == 0) throw std::logic_error(std::string("not allowed ") + component.phase_text());
      body(component);
      return Status::ok;
    } catch (const Discarded& e) {
      if (e.remedy == Discarded::Remedy::none) component.terminate_simulation = true;
      return component.report(Status::discard, e.what());
    } catch (const std::exception& e) {
      return component.report(Status::error, e.what());
    }
  } catch (...) {  // out of memory while reporting, or what is no std::exception
    phase = error;
    return Status::error;
  }
}

/// A new instance; NULL, with a message, if it is not for co-simulation, has no name, or `identity` is not the
/// description's. @throws std::bad_alloc
Component* instantiate(const char* function, const Log& log, bool log_events, const TypeNames& type_names,
                       bool co_simulation, const char* name, const char* identity);

}  // namespace fmi
