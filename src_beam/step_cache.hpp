// What an integrator keeps for each step size.
#pragma once

#include <array>
#include <cstddef>

namespace beam {

/// What depends on the step size alone, kept for the last few sizes: an event is located with other sizes, after
/// which the nominal one costs nothing. A cached value equals the recomputed one bit by bit.
template <typename Value>
class StepCache {
 public:
  /// The value of `size`; if it is not there, of the size not used for longest, made over by `make(size, value)`.
  /// Valid until the next call.
  template <typename Make>
  const Value& get(double size, const Make& make) {
    ++clock_;
    Entry* oldest = &entries_[0];
    for (Entry& entry : entries_) {
      if (entry.size == size) {
        entry.used = clock_;
        return entry.value;
      }
      if (entry.used < oldest->used) oldest = &entry;
    }
    oldest->size = 0.0;  // no step size: a throwing make() must not leave a wrong entry
    make(size, oldest->value);
    oldest->size = size;
    oldest->used = clock_;
    return oldest->value;
  }

 private:
  struct Entry {
    double size = 0.0;
    std::size_t used = 0;
    Value value;
  };
  std::array<Entry, 4> entries_;
  std::size_t clock_ = 0;
};

}  // namespace beam
