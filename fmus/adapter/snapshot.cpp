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

constexpr char magic[8] = {'s', 'p', 'r', 'i', 'n', 'g', 'b', 'm'};
constexpr std::uint32_t format = 2;
constexpr std::uint32_t byte_order = 0x01020304;
constexpr std::size_t guid_length = 38;

struct Header {
  char magic[8];
  std::uint32_t byte_order;
  std::uint32_t format;
  char guid[40];
  std::uint64_t count;     ///< doubles that follow
  std::uint64_t checksum;  ///< of them
};
static_assert(sizeof(Header) == 72, "the header has no padding");

constexpr std::size_t fixed_count = 7;  ///< doubles before the settings

std::vector<double> packed(const Snapshot& s) {
  const Progress& p = s.progress;
  std::vector<double> values{
      static_cast<double>(p.phase), static_cast<double>(p.last_status),    p.time, p.stop_time, p.tolerance,
      p.built ? 1.0 : 0.0,          static_cast<double>(s.numerics.size())};
  values.insert(values.end(), s.settings->begin(), s.settings->end());
  for (const Polynomial& input : s.inputs) values.insert(values.end(), input.begin(), input.end());
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
  std::memcpy(header.magic, magic, sizeof magic);
  header.byte_order = byte_order;
  header.format = format;
  guid.copy(header.guid, guid_length);
  header.count = values.size();
  const std::size_t payload = values.size() * sizeof(double);
  std::memcpy(bytes + sizeof header, values.data(), payload);
  header.checksum = hash(bytes + sizeof header, payload);
  std::memcpy(bytes, &header, sizeof header);
}

Snapshot deserialize(const char* bytes, std::size_t size, const std::string& guid, std::size_t n_settings,
                     std::size_t n_inputs) {
  Header header{};
  if (size < sizeof header) refuse(std::to_string(size) + " bytes are fewer than its header has");
  std::memcpy(&header, bytes, sizeof header);
  if (std::memcmp(header.magic, magic, sizeof magic) != 0) refuse("they do not begin with its mark");
  if (header.byte_order != byte_order) refuse("written on a machine of another byte order");
  if (header.format != format) {
    refuse("format " + std::to_string(header.format) + ", this FMU reads " + std::to_string(format));
  }
  const std::string written_by(header.guid, guid_length);
  if (written_by != guid) refuse("written by the FMU " + written_by + ", this is " + guid);
  const std::size_t payload = size - sizeof header;
  if (header.count > payload / sizeof(double) || header.count * sizeof(double) != payload) {
    refuse(std::to_string(size) + " bytes, its header announces " +
           std::to_string(sizeof header + header.count * sizeof(double)));
  }
  if (hash(bytes + sizeof header, payload) != header.checksum) refuse("the checksum is wrong");

  const std::size_t inputs_begin = fixed_count + n_settings, numerics_begin = inputs_begin + 3 * n_inputs;
  if (header.count < numerics_begin) refuse("its parts do not add up");
  std::vector<double> values(header.count);
  std::memcpy(values.data(), bytes + sizeof header, payload);
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
  s.settings = std::make_shared<const std::vector<double>>(from + fixed_count, from + inputs_begin);
  for (const double* p = from + inputs_begin; p != from + numerics_begin; p += 3)
    s.inputs.push_back({p[0], p[1], p[2]});
  s.numerics.assign(from + numerics_begin, from + values.size());
  return s;
}

}  // namespace fmi
