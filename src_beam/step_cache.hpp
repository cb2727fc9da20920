// What an integrator keeps for each step size.
#pragma once

#include <algorithm>
#include <array>

namespace beam {

/// What depends on the step size alone, kept for the last few sizes: an event is located with other sizes, after
/// which the nominal one costs nothing. A cached value equals the recomputed one bit by bit.
template <typename Value>
class StepCache {
 public:
  /// The value of `size`; if it is not there, the one not used for longest, made over by `make(size, value)`.
  /// Valid until the next call.
  template <typename Make>
  const Value& get(double size, const Make& make) {
    const auto has_size = [size](const Entry& entry) { return entry.size == size; };
    auto place = std::find_if(latest_first_.begin(), latest_first_.end() - 1, has_size);
    if (place->size != size) {
      place->size = 0.0;  // no step size: a throwing make() must not leave a wrong entry
      make(size, place->value);
      place->size = size;
    }
    std::rotate(latest_first_.begin(), place, place + 1);
    return latest_first_.front().value;
  }

 private:
  struct Entry {
    double size = 0.0;
    Value value;
  };
  std::array<Entry, 4> latest_first_;
};

}  // namespace beam
