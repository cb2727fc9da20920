// Numbers as text and bytes as a number.
#pragma once

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <string>

namespace fmi {

/// The shortest decimal that reads back as the same double, for the XML and for messages.
inline std::string text(double value) {
  char buffer[32];
  return std::string(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
}

/// FNV-1a.
inline std::uint64_t hash(const char* bytes, std::size_t size, std::uint64_t seed = 0xcbf29ce484222325ULL) {
  for (std::size_t i = 0; i < size; ++i) seed = (seed ^ static_cast<unsigned char>(bytes[i])) * 0x100000001b3ULL;
  return seed;
}

}  // namespace fmi
