// A state as the flat array of doubles that is saved: plain structs and arrays of doubles, one after the other.
#pragma once

#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace fmi {

/// Where the doubles are, and how many, of an array that has data() and size(), as Eigen's vectors, or of a plain
/// struct of doubles.
template <class Part>
auto doubles(Part& part) {
  if constexpr (std::is_trivially_copyable_v<Part>) {
    static_assert(sizeof part % sizeof(double) == 0);
    return std::pair{&part,
                     sizeof part / sizeof(double)};  // NOLINT(bugprone-sizeof-expression): may be a double itself
  } else {
    return std::pair{part.data(), static_cast<std::size_t>(part.size())};
  }
}

template <class... Parts>
void flatten(std::vector<double>& flat, const Parts&... parts) {
  flat.resize((doubles(parts).second + ...));
  double* end = flat.data();
  const auto append = [&end](const auto& part) {
    const auto [from, count] = doubles(part);
    std::memcpy(end, from, count * sizeof(double));
    end += count;
  };
  (append(parts), ...);
}

/// Fills parts of the same sizes. @throws std::invalid_argument, nothing being changed, if the length is not theirs
template <class... Parts>
void restore(const std::vector<double>& flat, Parts&... parts) {
  if (flat.size() != (doubles(parts).second + ...)) {
    throw std::invalid_argument("a saved state of " + std::to_string(flat.size()) +
                                " numbers does not belong to this instance");
  }
  const double* begin = flat.data();
  const auto take = [&begin](auto& part) {
    const auto [to, count] = doubles(part);
    std::memcpy(static_cast<void*>(to), begin, count * sizeof(double));
    begin += count;
  };
  (take(parts), ...);
}

}  // namespace fmi
