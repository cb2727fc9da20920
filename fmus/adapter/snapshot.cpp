#include "snapshot.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <stdexcept>

#include "text.hpp"

namespace fmi {
namespace {

constexpr std::size_t guid_length = 38;

struct Header {
  char guid[40];
  std::uint64_t checksum;  ///< of the doubles that follow
};
static_assert(sizeof(Header) == 48, "the header has no padding");

constexpr std::size_t fixed_count = 7;  ///< doubles before the values

std::vector<double> packed(const Snapshot& s) {
  const Progress& p = s.progress;
  std::vector<double> values{
      static_cast<double>(p.phase), static_cast<double>(p.last_status),    p.time, p.stop_time, p.tolerance,
      p.built ? 1.0 : 0.0,          static_cast<double>(s.numerics.size())};
  for (const Polynomial& value : s.values) values.insert(values.end(), value.begin(), value.end());
  values.insert(values.end(), s.numerics.begin(), s.numerics.end());
  return values;
}

[[noreturn]] void refuse(const std::string& why) {
  throw std::invalid_argument("the bytes are not a saved state of this FMU: " + why);
}

}  // namespace

std::size_t serialized_size(const Snapshot& s) { return sizeof(Header) + packed(s).size() * sizeof(double); }

void serialize(const Snapshot& s, const std::string& guid, char* bytes) {
  const std::vector<double> values = packed(s);
  Header header{};
  guid.copy(header.guid, guid_length);
  const std::size_t payload = values.size() * sizeof(double);
  std::memcpy(bytes + sizeof header, values.data(), payload);
  header.checksum = hash(bytes + sizeof header, payload);
  std::memcpy(bytes, &header, sizeof header);
}

Snapshot deserialize(const char* bytes, std::size_t size, const std::string& guid, std::size_t n_values) {
  Header header{};
  if (size < sizeof header) refuse(std::to_string(size) + " bytes are fewer than its header has");
  std::memcpy(&header, bytes, sizeof header);
  if (guid.compare(0, guid_length, header.guid, guid_length) != 0) refuse("not written by the FMU " + guid);
  const std::size_t payload = size - sizeof header;
  if (hash(bytes + sizeof header, payload) != header.checksum) refuse("they are damaged, the checksum is wrong");

  const std::size_t numerics_begin = fixed_count + 3 * n_values;
  std::vector<double> values(payload / sizeof(double));
  if (values.size() < numerics_begin) refuse("its parts do not add up");
  std::memcpy(values.data(), bytes + sizeof header, values.size() * sizeof(double));
  if (static_cast<double>(values.size() - numerics_begin) != values[6]) refuse("its parts do not add up");
  // A checksum is no signature: what the numbers mean is checked too, here and in Instance::restore.
  const auto known = [&values](std::size_t i, std::initializer_list<double> allowed) {
    return std::find(allowed.begin(), allowed.end(), values[i]) != allowed.end();
  };
  if (!known(0, {1, 2, 4, 8, 16, 32}) || !known(1, {0, 1, 2, 3}) || !known(5, {0, 1}) || !std::isfinite(values[2]) ||
      std::isnan(values[3]) || !(values[4] >= 0.0 && values[4] < 1.0)) {
    refuse("it says what no instance says of itself");
  }
  Snapshot s;
  s.progress = {static_cast<Phase>(static_cast<int>(values[0])),
                static_cast<int>(values[1]),
                values[2],
                values[3],
                values[4],
                values[5] != 0.0};
  s.foreign = true;
  const double* from = values.data();
  for (const double* p = from + fixed_count; p != from + numerics_begin; p += 3) s.values.push_back({p[0], p[1], p[2]});
  s.numerics.assign(from + numerics_begin, from + values.size());
  return s;
}

}  // namespace fmi
