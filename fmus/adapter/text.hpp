// Numbers as text, bytes as a number.
#pragma once

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <string>

namespace fmi {

/// The shortest decimal that reads back as the same double.
inline std::string number(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

/// FNV-1a.
inline std::uint64_t hash(const char* bytes, std::size_t size, std::uint64_t seed = 0xcbf29ce484222325ULL) {
  for (std::size_t i = 0; i < size; ++i) seed = (seed ^ static_cast<unsigned char>(bytes[i])) * 0x100000001b3ULL;
  return seed;
}

}  // namespace fmi
