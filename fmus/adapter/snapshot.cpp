#include "snapshot.hpp"

#include <cstdint>
#include <cstring>
#include <stdexcept>

#include "table.hpp"

namespace fmi {
namespace {

constexpr std::size_t progress_count = 4;  ///< doubles before the values

/// What precedes the doubles.
std::string header(std::string_view doubles) {
  const std::uint64_t checksum = common::hash(doubles);
  return guid() + std::string(reinterpret_cast<const char*>(&checksum), sizeof checksum);
}

[[noreturn]] void refuse(const std::string& why) {
  throw std::invalid_argument("the bytes are not a saved state of this FMU: " + why);
}

}  // namespace

std::string serialized(const Snapshot& s) {
  const Progress& p = s.progress;
  std::vector<double> numbers{static_cast<double>(p.phase), p.time, p.stop_time, p.tolerance};
  for (const Polynomial& value : s.values) numbers.insert(numbers.end(), value.begin(), value.end());
  numbers.insert(numbers.end(), s.numerics.begin(), s.numerics.end());
  const std::string_view doubles(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(double));
  return header(doubles).append(doubles);
}

Snapshot deserialized(std::string_view bytes, std::size_t n_values) {
  const std::size_t header_size = header({}).size();
  if (bytes.size() < header_size) refuse(std::to_string(bytes.size()) + " bytes are fewer than its header has");
  if (bytes.substr(0, guid().size()) != guid()) refuse("not written by the FMU " + guid());
  const std::string_view doubles = bytes.substr(header_size);
  if (bytes.substr(0, header_size) != header(doubles)) refuse("they are damaged, the checksum is wrong");

  std::vector<double> numbers(doubles.size() / sizeof(double));
  if (numbers.size() < progress_count + 3 * n_values) refuse("some are missing");
  std::memcpy(numbers.data(), doubles.data(), numbers.size() * sizeof(double));
  auto p = numbers.cbegin();
  if (!(p[0] >= 1.0 && p[0] <= event_mode)) refuse("it has no phase");
  Snapshot s;
  s.progress = {static_cast<Phase>(static_cast<unsigned>(p[0])), p[1], p[2], p[3]};
  p += progress_count;
  for (std::size_t i = 0; i < n_values; ++i, p += 3) s.values.push_back({p[0], p[1], p[2]});
  s.numerics.assign(p, numbers.cend());
  return s;
}

}  // namespace fmi
