// A state as the flat array of doubles that is saved: plain structs and arrays of doubles, one after the other.
#pragma once

#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace fmi {

/// The doubles of an array that has data() and size(), as Eigen's vectors, or of a plain struct of doubles.
template <class Part>
std::size_t doubles(const Part& part) {
  if constexpr (std::is_trivially_copyable_v<Part>) {
    static_assert(sizeof part % sizeof(double) == 0);
    return sizeof part / sizeof(double);  // NOLINT(bugprone-sizeof-expression): Part may be a double itself
  } else {
    return static_cast<std::size_t>(part.size());
  }
}

template <class Part>
auto address(Part& part) {
  if constexpr (std::is_trivially_copyable_v<std::remove_const_t<Part>>) {
    return &part;
  } else {
    return part.data();
  }
}

template <class... Parts>
void flatten(std::vector<double>& flat, const Parts&... parts) {
  flat.resize((doubles(parts) + ...));
  double* end = flat.data();
  const auto append = [&end](const auto& part) {
    std::memcpy(end, address(part), doubles(part) * sizeof(double));
    end += doubles(part);
  };
  (append(parts), ...);
}

/// Fills parts of the same sizes. @throws std::invalid_argument, nothing being changed, if the length is not theirs
template <class... Parts>
void restore(const std::vector<double>& flat, Parts&... parts) {
  if (flat.size() != (doubles(parts) + ...)) {
    throw std::invalid_argument("a saved state of " + std::to_string(flat.size()) +
                                " numbers does not belong to this instance");
  }
  const double* begin = flat.data();
  const auto take = [&begin](auto& part) {
    std::memcpy(static_cast<void*>(address(part)), begin, doubles(part) * sizeof(double));
    begin += doubles(part);
  };
  (take(parts), ...);
}

}  // namespace fmi
