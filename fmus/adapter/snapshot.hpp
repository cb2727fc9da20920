// A saved FMU state, and its serialised form: a header (magic, format, GUID, size, checksum), then doubles. No
// pointers; readable by any instance of the same FMU in any process.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "model.hpp"

namespace fmi {

struct Snapshot {
  int phase = 0;
  int last_status = 0;
  double time = 0.0, stop_time = 0.0, tolerance = 0.0;
  bool built = false;
  bool foreign = false;                                 ///< came as bytes: what its numbers mean is not checked yet
  std::shared_ptr<const std::vector<double>> settings;  ///< of what is set before the start: shared, as it stays
  std::vector<Polynomial> inputs;
  std::vector<double> numerics;  ///< of the model; empty if not built
};

std::size_t serialized_size(const Snapshot& snapshot);
void serialize(const Snapshot& snapshot, const std::string& guid, char* bytes);

/// @throws std::invalid_argument saying why the bytes are not a state of this FMU
Snapshot deserialize(const char* bytes, std::size_t size, const std::string& guid, std::size_t n_settings,
                     std::size_t n_inputs);

}  // namespace fmi
