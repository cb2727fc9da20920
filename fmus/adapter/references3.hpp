// Value references of FMI 3.0: the table's variables, the time, then the first derivatives of inputs, then the second.
#pragma once

#include "table.hpp"

namespace fmi {

struct Reference3 {
  unsigned index;  ///< in the table; its size for the time
  int order;       ///< of the derivative
};

inline unsigned time_index() { return static_cast<unsigned>(table().variables.size()); }
inline Reference3 meant_by(unsigned reference) {
  const unsigned order = reference / (time_index() + 1);
  // What is too large is no variable's index either.
  if (order > max_input_derivative_order) return {reference, 0};
  return {reference % (time_index() + 1), static_cast<int>(order)};
}

}  // namespace fmi
