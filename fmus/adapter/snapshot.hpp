// A saved FMU state, and its serialised form: the GUID, a checksum, then doubles. No pointers; readable by any instance
// of the same FMU in any process.
#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "model.hpp"

namespace fmi {

/// The states of FMI 2.0.4, section 4.2.4, that a slave which completes every step at once can be in, as bits, and the
/// event mode of FMI 3.0.
enum Phase : unsigned {
  instantiated = 1U << 0,
  initialization = 1U << 1,
  step_complete = 1U << 2,
  terminated = 1U << 3,
  error = 1U << 4,
  event_mode = 1U << 5,
};

/// How far an instance is in its life.
struct Progress {
  Phase phase = instantiated;
  double time = 0.0, stop_time = std::numeric_limits<double>::infinity();
  double tolerance = 0.0;  ///< relative, of the importer; 0 = none
};

struct Snapshot {
  Progress progress;
  std::vector<Polynomial> values;  ///< of what can be set
  std::vector<double> numerics;    ///< of the model; empty if not built
};

std::string serialized(const Snapshot& snapshot);

/// @throws std::invalid_argument saying why the bytes are not a state of this FMU, with values of `n_values` variables
Snapshot deserialized(std::string_view bytes, std::size_t n_values);

}  // namespace fmi
