// Gauss–Legendre quadrature with 8 points on [0, 1], exact to degree 15.
#pragma once

#include <array>
#include <cstddef>

namespace beam {

/// Calls use(point, weight) at each of the points.
template <typename Use>
void at_gauss_points(const Use& use) {
  // Those of one half; the other is symmetric about 1/2.
  constexpr std::array<double, 4> node = {0.0198550717512318841582, 0.1016667612931866302042, 0.2372337950418355070911,
                                          0.4082826787521750975303};
  constexpr std::array<double, 4> weight = {0.0506142681451881295763, 0.1111905172266872352722,
                                            0.1568533229389436436690, 0.1813418916891809914826};
  for (std::size_t i = 0; i < node.size(); ++i) {
    use(node[i], weight[i]);
    use(1.0 - node[i], weight[i]);
  }
}

}  // namespace beam
