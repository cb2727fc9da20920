// The functions that FMI 2.0 and 3.0 have alike, but for their names: `fmi` begins them all, `State` and `Deserialize`
// are spelt otherwise. Whoever takes them has call(), which runs a member of Component in the phases named.
#pragma once

#define SPRINGBEAM_COMMON_FUNCTIONS(fmi, State, Deserialize)                                                        \
  void fmi##FreeInstance(void* c) { delete static_cast<Component*>(c); }                                            \
  fmi##Status fmi##SetDebugLogging(void* c, fmi##Boolean on, size_t n, const fmi##String categories[]) {            \
    return call(c, __func__, any_phase, &Component::set_debugging, on, n, categories);                              \
  }                                                                                                                 \
  fmi##Status fmi##ExitInitializationMode(void* c) { return call(c, __func__, initialization, &Component::start); } \
  fmi##Status fmi##Terminate(void* c) {                                                                             \
    return call(c, __func__, running, &Component::enter, terminated, "terminated");                                 \
  }                                                                                                                 \
  fmi##Status fmi##Reset(void* c) { return call(c, __func__, any_phase, &Component::reset); }                       \
  fmi##Status fmi##Get##State(void* c, void** state) {                                                              \
    return call(c, __func__, any_phase, &Component::get_state, state);                                              \
  }                                                                                                                 \
  fmi##Status fmi##Set##State(void* c, void* state) {                                                               \
    return call(c, __func__, any_phase, &Component::set_state, state);                                              \
  }                                                                                                                 \
  fmi##Status fmi##Free##State(void* c, void** state) {                                                             \
    return call(c, __func__, any_phase, &Component::free_state, state);                                             \
  }                                                                                                                 \
  fmi##Status fmi##Serialized##State##Size(void* c, void* state, size_t* size) {                                    \
    return call(c, __func__, any_phase, &Component::state_size, state, size);                                       \
  }                                                                                                                 \
  fmi##Status fmi##Serialize##State(void* c, void* state, fmi##Byte bytes[], size_t size) {                         \
    return call(c, __func__, any_phase, &Component::serialize, state, bytes, size);                                 \
  }                                                                                                                 \
  fmi##Status fmi##Deserialize##State(void* c, const fmi##Byte bytes[], size_t size, void** state) {                \
    return call(c, __func__, any_phase, &Component::deserialize, bytes, size, state);                               \
  }
