#include "component.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "description.hpp"

namespace fmi {

Component::Component(const fmi2CallbackFunctions* functions, const char* name, bool log_events)
    : callbacks_(functions ? *functions : fmi2CallbackFunctions{}), name_(name), events_(log_events) {}

void Component::log(fmi2Status status, const char* category, const std::string& message) const {
  if (!callbacks_.logger) return;
  if (status == fmi2OK && !events_) return;
  // Some importers treat the message as a printf format, some print it as it is: both get a readable text.
  std::string format;
  for (const char c : message) format += c == '%' ? std::string("%%") : std::string(1, c);
  callbacks_.logger(callbacks_.componentEnvironment, name_.c_str(), status, category, format.c_str());
}

bool Component::set_debugging(bool on, std::size_t n, const fmi2String categories[]) {
  bool all_known = true, events = n == 0;
  for (std::size_t i = 0; i < n; ++i) {
    require(categories[i], "a category");
    const std::string name = categories[i];
    const auto same = [&](const LogCategory& category) { return name == category.name; };
    events = events || name == "logEvents" || name == "logAll";
    if (std::any_of(std::begin(log_categories), std::end(log_categories), same)) continue;
    all_known = false;
    log(fmi2Warning, "logStatusWarning", "fmi2SetDebugLogging: there is no log category '" + name + "'");
  }
  events_ = on && events;
  return all_known;
}

Snapshot& Component::state(fmi2FMUstate key) {
  const auto found = states_.find(key);
  if (found == states_.end()) {
    throw std::invalid_argument("the FMU state was not made by this instance, or is already freed");
  }
  return *found->second;
}

fmi2FMUstate Component::keep(Snapshot snapshot) {
  auto owned = std::make_unique<Snapshot>(std::move(snapshot));
  const fmi2FMUstate key = owned.get();
  states_[key] = std::move(owned);
  return key;
}

void Component::save(fmi2FMUstate& key) {
  Snapshot* const into = key ? &state(key) : nullptr;
  instance.save(spare_);
  if (into) {
    std::swap(*into, spare_);
  } else {
    key = keep(std::exchange(spare_, {}));
  }
}

void Component::free_state(fmi2FMUstate key) {
  state(key);
  states_.erase(key);
}

const char* Component::phase_text() const {
  const Phase p = instance.progress.phase;
  return p == instantiated     ? "before initialization"
         : p == initialization ? "in initialization mode"
         : p == step_complete  ? "between steps"
         : p == terminated     ? "after termination"
                               : "after an error (restore a state or reset first)";
}

fmi2Status Component::fail(const char* function, const char* why) {
  log(fmi2Error, "logStatusError", std::string(function) + ": " + why);
  instance.progress.phase = error;
  return fmi2Error;
}

}  // namespace fmi
