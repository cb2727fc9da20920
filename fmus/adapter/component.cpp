#include "component.hpp"

#include <algorithm>
#include <iterator>

namespace fmi {

void Component::enter(Phase phase, const char* event) {
  instance.progress.phase = phase;
  note(event);
}

Model::Reached Component::step(const char* function, double time, double size, bool to_event) {
  const Model::Reached reached = instance.step(time, size, to_event);
  const std::string warning = instance.take_warning();
  if (!warning.empty()) log(Status::warning, "logStatusWarning", std::string(function) + ": " + warning);
  return reached;
}

Snapshot& Component::state(void* key) {
  const auto found = states.find(key);
  if (found == states.end()) {
    throw std::invalid_argument("the FMU state was not made by this instance, or is already freed");
  }
  return *found->second;
}

void* Component::keep(Snapshot snapshot) {
  auto owned = std::make_unique<Snapshot>(std::move(snapshot));
  void* const key = owned.get();
  states[key] = std::move(owned);
  return key;
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

Status Component::fail(const char* function, const char* why) {
  log(Status::error, "logStatusError", std::string(function) + ": " + why);
  instance.progress.phase = error;
  return Status::error;
}

Status instantiate(Component* c, const char* function, const char* name, const char* identity) {
  return guard(c, function, instantiated, [&](Component& k) {
    if (!name || !*name) throw std::invalid_argument("instanceName is empty");
    require(identity, "the GUID");
    if (guid() != identity) {
      throw std::invalid_argument("the GUID " + std::string(identity) + " is not that of this FMU, " + guid());
    }
    k.note("instantiated");
  });
}

Status set_debugging(void* c, const char* function, bool on, std::size_t n, const char* const categories[]) {
  bool all_known = true;
  const Status status = guard(c, function, any_phase, [&](Component& k) {
    require_arrays(n, {{categories, "categories"}});
    bool events = n == 0;
    for (std::size_t i = 0; i < n; ++i) {
      require(categories[i], "a category");
      const std::string name = categories[i];
      const auto same = [&](const LogCategory& category) { return name == category.name; };
      if (std::none_of(std::begin(log_categories), std::end(log_categories), same)) {
        all_known = false;
        k.log(Status::warning, "logStatusWarning", std::string(function) + ": there is no log category '" + name + "'");
      }
      events = events || name == "logEvents" || name == "logAll";
    }
    k.log_events = on && events;
  });
  return status == Status::ok && !all_known ? Status::warning : status;
}

Status reset(void* c, const char* function) {
  return guard(c, function, any_phase, [](Component& k) {
    k.instance.reset();
    k.note("reset");
  });
}

Status none_of(void* c, const char* function, unsigned legal, std::size_t n, const char* type) {
  return guard(c, function, legal, [&](Component&) {
    if (n > 0) throw std::invalid_argument(std::string("there are no variables of type ") + type);
  });
}

Status get_state(void* c, const char* function, void** state) {
  return guard(c, function, any_phase, [&](Component& k) {
    require(state, "the FMU state");
    Snapshot* const into = *state ? &k.state(*state) : nullptr;
    k.instance.save(k.spare);  // if that fails, nothing has changed
    if (into) {
      std::swap(*into, k.spare);
    } else {
      *state = k.keep(std::exchange(k.spare, {}));
    }
  });
}

Status set_state(void* c, const char* function, void* state) {
  return guard(c, function, any_phase, [&](Component& k) {
    require(state, "the FMU state");
    k.instance.restore(k.state(state));
  });
}

Status free_state(void* c, const char* function, void** state) {
  return guard(c, function, any_phase, [&](Component& k) {
    if (!state || !*state) return;
    k.state(*state);
    k.states.erase(std::exchange(*state, nullptr));
  });
}

Status state_size(void* c, const char* function, void* state, std::size_t* size) {
  return guard(c, function, any_phase, [&](Component& k) {
    require(size, "size");
    *size = serialized_size(k.state(state));
  });
}

Status serialize_state(void* c, const char* function, void* state, void* bytes, std::size_t size) {
  return guard(c, function, any_phase, [&](Component& k) {
    require(bytes, "serializedState");
    const Snapshot& snapshot = k.state(state);
    const std::size_t needed = serialized_size(snapshot);
    if (size < needed) {
      throw std::invalid_argument("size = " + std::to_string(size) + ", needed are " + std::to_string(needed));
    }
    serialize(snapshot, guid(), static_cast<char*>(bytes));
  });
}

Status deserialize_state(void* c, const char* function, const void* bytes, std::size_t size, void** state) {
  return guard(c, function, any_phase, [&](Component& k) {
    require(bytes, "serializedState");
    require(state, "the FMU state");
    // Purely an output, unlike get_state's: importers leave anything in it.
    *state = k.keep(deserialize(static_cast<const char*>(bytes), size, guid(), k.instance.n_values()));
  });
}

Status output_derivatives(void* c, const char* function, const unsigned references[], std::size_t n, const int orders[],
                          double values[]) {
  return guard(c, function, stepped, [&](Component& k) {
    require_arrays(n, {{references, "the array of value references"}, {orders, "order"}, {values, "value"}});
    for (std::size_t i = 0; i < n; ++i) values[i] = k.instance.output_derivative(references[i], orders[i]);
  });
}

Status directional_derivative(void* c, const char* function, const unsigned unknowns[], std::size_t n_unknowns,
                              const unsigned knowns[], std::size_t n_knowns, const double seed[],
                              double sensitivity[]) {
  return guard(c, function, after_instantiation, [&](Component& k) {
    require_arrays(n_unknowns, {{unknowns, "the array of unknowns"}, {sensitivity, "the array of results"}});
    require_arrays(n_knowns, {{knowns, "the array of knowns"}, {seed, "the array of their changes"}});
    for (std::size_t i = 0; i < n_unknowns; ++i) {
      double sum = 0.0;
      for (std::size_t j = 0; j < n_knowns; ++j) {
        sum += k.instance.partial_derivative(unknowns[i], knowns[j]) * seed[j];
      }
      sensitivity[i] = sum;
    }
  });
}

}  // namespace fmi
