// What every version of FMI asks of an instance besides its life cycle: messages, saved states behind opaque pointers,
// arrays of values, and one guard that turns C++ exceptions into a status and a message. No FMI types: the surface of a
// version (fmi2_slave.cpp) names its functions, says in which phases they are legal, and converts.
#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "instance.hpp"

namespace fmi {

enum class Status { ok, warning, discard, error };  ///< numbered as in every version of FMI

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
  using Logger = std::function<void(Status, const char* category, const std::string& message)>;

  Component(Logger logger, bool debug);

  Instance instance;

  /// Messages that are no warning, discard or error are sent if debugging is on for their category.
  void log(Status status, const char* category, const std::string& message) const;
  /// No category: all of them. Returns those that do not exist.
  std::vector<std::string> set_debugging(bool on, std::size_t n, const char* const categories[]);

  /// @throws std::invalid_argument if the state was not made by this instance, or is already freed
  Snapshot& state(void* key);
  void* keep(Snapshot snapshot);
  void free_state(void* key);

  template <class Value>
  void get(const unsigned references[], std::size_t n, Value values[], Type type) {
    if (n == 0) return;
    require(references, "vr");
    require(values, "value");
    for (std::size_t i = 0; i < n; ++i) values[i] = static_cast<Value>(instance.get(references[i], type));
  }

  template <class Value>
  void set(const unsigned references[], std::size_t n, const Value values[], Type type) {
    if (n == 0) return;
    require(references, "vr");
    require(values, "value");
    for (std::size_t i = 0; i < n; ++i) {
      instance.set(references[i], type, static_cast<double>(type == Type::boolean ? Value(values[i] != 0) : values[i]));
    }
  }

  /// Runs `body`, which may throw, if the instance is in one of the `legal` phases.
  template <class Body>
  Status guard(const char* function, unsigned legal, const Body& body) noexcept {
    try {
      try {
        if ((instance.phase & legal) == 0) throw std::logic_error(std::string("not allowed ") + phase_text());
        body();
        return Status::ok;
      } catch (const Discarded& e) {
        log(Status::discard, "logStatusDiscard", std::string(function) + ": " + e.what());
        return Status::discard;
      } catch (const std::exception& e) {
        return fail(function, e.what());
      } catch (...) {
        return fail(function, "unknown exception");
      }
    } catch (...) {  // out of memory while reporting
      instance.phase = error;
      return Status::error;
    }
  }

 private:
  const char* phase_text() const;
  Status fail(const char* function, const char* why);

  Logger logger_;
  bool debug_;
  std::set<std::string> categories_;  ///< switched on for debugging
  std::map<void*, std::unique_ptr<Snapshot>> states_;
};

}  // namespace fmi
