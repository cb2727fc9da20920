#include "component.hpp"

#include <algorithm>
#include <cstring>
#include <iterator>

namespace fmi {

Status Component::report(Status status, const std::string& what) {
  constexpr const char* categories[] = {"logEvents", "logStatusWarning", "logStatusDiscard", "logStatusError"};
  if (status == Status::error) instance.progress.phase = error;
  const bool event = status == Status::ok;
  if (log_ && (!event || log_events_))
    log_(status, categories[static_cast<int>(status)], event ? what : std::string(function) + ": " + what);
  return status;
}

void Component::enter(Phase phase, const char* event) {
  instance.progress.phase = phase;
  report(Status::ok, event);
}

const char* Component::phase_text() const {
  const Phase p = instance.progress.phase;
  return p == instantiated     ? "before initialization"
         : p == initialization ? "in initialization mode"
         : p == step_complete  ? "between steps"
         : p == event_mode     ? "in event mode"
         : p == terminated     ? "after termination"
                               : "after an error (restore a state or reset first)";
}

void Component::set_debugging(bool on, std::size_t n, const char* const categories[]) {
  require_arrays(n, {{categories, "categories"}});
  bool events = n == 0;
  for (std::size_t i = 0; i < n; ++i) {
    require(categories[i], "a category");
    const std::string name = categories[i];
    const auto same = [&](const LogCategory& category) { return name == category.name; };
    if (std::none_of(std::begin(log_categories), std::end(log_categories), same))
      report(Status::warning, "there is no log category '" + name + "'");
    events = events || name == "logEvents" || name == "logAll";
  }
  log_events_ = on && events;
}

void Component::start() {
  instance.start();
  enter(event_mode_used ? event_mode : step_complete, "initialized");
}

void Component::reset() {
  instance.reset();
  terminate_simulation = false;
  report(Status::ok, "reset");
}

Reached Component::step(double time, double size, bool to_event) {
  terminate_simulation = false;
  const Reached reached = instance.step(time, size, to_event);
  const std::string warning = instance.take_warning();
  if (!warning.empty()) report(Status::warning, warning);
  return reached;
}

Snapshot& Component::found(void* state) {
  require(state, "the FMU state");
  const auto place = states_.find(state);
  if (place == states_.end()) {
    throw std::invalid_argument("the FMU state was not made by this instance, or is already freed");
  }
  return *place->second;
}

void* Component::keep(Snapshot snapshot) {
  auto owned = std::make_unique<Snapshot>(std::move(snapshot));
  void* const key = owned.get();
  states_[key] = std::move(owned);
  return key;
}

void Component::get_state(void** state) {
  require(state, "the FMU state");
  Snapshot* const into = *state ? &found(*state) : nullptr;
  instance.save(spare_);  // if that fails, nothing has changed
  if (into) {
    std::swap(*into, spare_);
  } else {
    *state = keep(std::exchange(spare_, {}));
  }
}

void Component::set_state(void* state) {
  instance.restore(found(state));
  terminate_simulation = false;
  // A state of an instance that has an event mode: here updates follow from steps.
  Phase& phase = instance.progress.phase;
  if (phase == event_mode && !event_mode_used) phase = step_complete;
}

void Component::free_state(void** state) {
  if (!state || !*state) return;
  found(*state);
  states_.erase(std::exchange(*state, nullptr));
}

void Component::state_size(void* state, std::size_t* size) {
  require(size, "size");
  *size = serialized(found(state)).size();
}

void Component::serialize(void* state, void* bytes, std::size_t size) {
  require(bytes, "serializedState");
  const std::string all = serialized(found(state));
  if (size < all.size()) {
    throw std::invalid_argument("size = " + std::to_string(size) + ", needed are " + std::to_string(all.size()));
  }
  std::memcpy(bytes, all.data(), all.size());
}

void Component::deserialize(const void* bytes, std::size_t size, void** state) {
  require(bytes, "serializedState");
  require(state, "the FMU state");
  Snapshot read = deserialized({static_cast<const char*>(bytes), size}, instance.n_values());
  try {
    instance.check(read);
  } catch (const std::exception& e) {
    throw std::invalid_argument(std::string("the bytes are not a saved state of this FMU: ") + e.what());
  }
  // Purely an output, unlike get_state's: importers leave anything in it.
  *state = keep(std::move(read));
}

void Component::refuse_all(std::size_t n, const char* type) const {
  if (n > 0) throw std::invalid_argument(std::string("there are no variables of type ") + type);
}

void Component::output_derivatives(const unsigned references[], std::size_t n, const int orders[], double values[]) {
  require_arrays(n, {{references, "the array of value references"}, {orders, "order"}, {values, "value"}});
  for (std::size_t i = 0; i < n; ++i) values[i] = instance.output_derivative(references[i], orders[i]);
}

void Component::directional_derivative(const unsigned unknowns[], std::size_t n_unknowns, const unsigned knowns[],
                                       std::size_t n_knowns, const double seed[], double sensitivity[]) {
  require_arrays(n_unknowns, {{unknowns, "the array of unknowns"}, {sensitivity, "the array of results"}});
  require_arrays(n_knowns, {{knowns, "the array of knowns"}, {seed, "the array of their changes"}});
  for (std::size_t i = 0; i < n_unknowns; ++i) {
    sensitivity[i] = 0.0;
    for (std::size_t j = 0; j < n_knowns; ++j)
      sensitivity[i] += instance.partial_derivative(unknowns[i], knowns[j]) * seed[j];
  }
}

Component* instantiate(const char* function, const Log& log, bool log_events, const TypeNames& type_names,
                       bool co_simulation, const char* name, const char* identity) {
  auto made = std::make_unique<Component>(log, log_events, type_names);
  const Status status = guard(made.get(), function, instantiated, [&](Component& k) {
    if (!co_simulation) throw std::invalid_argument("only co-simulation is provided");
    if (!name || !*name) throw std::invalid_argument("instanceName is empty");
    require(identity, "the GUID");
    if (guid() != identity) {
      throw std::invalid_argument("the GUID " + std::string(identity) + " is not that of this FMU, " + guid());
    }
    k.report(Status::ok, "instantiated");
  });
  return status == Status::ok ? made.release() : nullptr;
}

}  // namespace fmi
