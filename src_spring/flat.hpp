// A struct of doubles as the flat array that a saved state holds. The length is the struct's own.
#pragma once

#include <array>
#include <cstring>
#include <type_traits>

namespace spring {

template <class State>
using Flat = std::array<double, sizeof(State) / sizeof(double)>;

template <class State>
Flat<State> flat(const State& state) {
  static_assert(std::is_trivially_copyable_v<State> && sizeof(Flat<State>) == sizeof(State));
  Flat<State> numbers;
  std::memcpy(numbers.data(), &state, sizeof state);
  return numbers;
}

/// `numbers`: as many as Flat<State> has.
template <class State>
State from_flat(const double* numbers) {
  State state;
  std::memcpy(static_cast<void*>(&state), numbers, sizeof state);
  return state;
}

}  // namespace spring
