// What both bodies and the adapter share: quantities over a step, numbers as text. No FMI.
#pragma once

#include <array>
#include <charconv>
#include <cstdint>
#include <string>
#include <string_view>

namespace common {

/// A quantity that is quadratic in time over a step, p(τ) = p₀ + p₁τ + p₂τ²/2: its value and its first two time
/// derivatives at τ = 0.
using Polynomial = std::array<double, 3>;

inline double value(const Polynomial& p, double t) { return p[0] + t * (p[1] + t * p[2] / 2); }
inline double rate(const Polynomial& p, double t) { return p[1] + t * p[2]; }
/// Over 0 … t.
inline double mean(const Polynomial& p, double t) { return p[0] + t * (p[1] / 2 + t * p[2] / 6); }

/// How far a step came [s], and whether it ended at an event.
struct Reached {
  double size;
  bool event;
};

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

}  // namespace common
