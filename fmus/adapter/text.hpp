// Numbers as text, bytes as a number.
#pragma once

#include <charconv>
#include <cstdint>
#include <string>
#include <string_view>

namespace fmi {

/// The shortest decimal that reads back as the same double.
inline std::string number(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

/// FNV-1a.
inline std::uint64_t hash(std::string_view bytes, std::uint64_t seed = 0xcbf29ce484222325ULL) {
  for (const char byte : bytes) seed = (seed ^ static_cast<unsigned char>(byte)) * 0x100000001b3ULL;
  return seed;
}

}  // namespace fmi
