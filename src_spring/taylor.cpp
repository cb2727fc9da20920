#include "taylor.hpp"

namespace spring {

Taylor::Taylor(const std::array<double, max_order + 1>& derivatives, int order) : order_(order) {
  for (int k = 0; k <= order; ++k) d_[static_cast<std::size_t>(k)] = derivatives[static_cast<std::size_t>(k)];
}

double Taylor::integral(double t) const {
  return t * (d_[0] + t * (d_[1] / 2 + t * (d_[2] / 6 + t * (d_[3] / 24 + t * d_[4] / 120))));
}

double Taylor::integral_2(double t) const {
  return t * t * (d_[0] / 2 + t * (d_[1] / 6 + t * (d_[2] / 24 + t * (d_[3] / 120 + t * d_[4] / 720))));
}

double Taylor::squared_rate_integral(double t) const {
  // Four-point Gauss rule: exact for degree 7, Ṙ² has degree 6.
  constexpr std::array<double, 2> node{0.339981043584856264802665759103, 0.861136311594052575223946488893};
  constexpr std::array<double, 2> weight{0.652145154862546142626936050778, 0.347854845137453857373063949222};
  double sum = 0.0;
  for (std::size_t i = 0; i < 2; ++i) {
    const double left = rate(t * (1.0 - node[i]) / 2), right = rate(t * (1.0 + node[i]) / 2);
    sum += weight[i] * (left * left + right * right);
  }
  return sum * t / 2;
}

}  // namespace spring
