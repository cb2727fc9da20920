#include "component.hpp"

#include <algorithm>
#include <iterator>

#include "description.hpp"

namespace fmi {

Component::Component(Logger logger, bool debug) : logger_(std::move(logger)), debug_(debug) {
  for (const LogCategory& category : log_categories) categories_.insert(category.name);
}

void Component::log(Status status, const char* category, const std::string& message) const {
  if (!logger_) return;
  if (status == Status::ok && !(debug_ && (categories_.count(category) || categories_.count("logAll")))) return;
  logger_(status, category, message);
}

std::vector<std::string> Component::set_debugging(bool on, std::size_t n, const char* const categories[]) {
  std::set<std::string> chosen;
  std::vector<std::string> unknown;
  for (const LogCategory& category : log_categories) {
    if (n == 0) chosen.insert(category.name);
  }
  for (std::size_t i = 0; i < n; ++i) {
    require(categories[i], "a category");
    const std::string name = categories[i];
    const auto same = [&](const LogCategory& category) { return name == category.name; };
    const bool known = std::any_of(std::begin(log_categories), std::end(log_categories), same);
    known ? void(chosen.insert(name)) : unknown.push_back(name);
  }
  debug_ = on;
  categories_ = chosen;
  return unknown;
}

Snapshot& Component::state(void* key) {
  const auto found = states_.find(key);
  if (found == states_.end()) {
    throw std::invalid_argument("the FMU state was not made by this instance, or is already freed");
  }
  return *found->second;
}

void* Component::keep(Snapshot snapshot) {
  auto owned = std::make_unique<Snapshot>(std::move(snapshot));
  void* const key = owned.get();
  states_[key] = std::move(owned);
  return key;
}

void Component::free_state(void* key) {
  state(key);
  states_.erase(key);
}

const char* Component::phase_text() const {
  const Phase p = instance.phase;
  return p == instantiated     ? "before initialization"
         : p == initialization ? "in initialization mode"
         : p == step_complete  ? "between steps"
         : p == terminated     ? "after termination"
                               : "after an error (restore a state or reset first)";
}

Status Component::fail(const char* function, const char* why) {
  log(Status::error, "logStatusError", std::string(function) + ": " + why);
  instance.phase = error;
  return Status::error;
}

}  // namespace fmi
