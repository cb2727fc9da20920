// Numbers as text.
#pragma once

#include <charconv>
#include <string>

namespace beam {

/// The shortest decimal that reads back as the same double.
inline std::string number(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

}  // namespace beam
