#include "taylor.hpp"

namespace spring {

Taylor::Taylor(const Series& coefficients, int order) : order_(order) {
  for (std::size_t k = 0; k <= static_cast<std::size_t>(order); ++k) {
    c_[k] = coefficients[k];
    if (k > 0) rate_[k - 1] = static_cast<double>(k) * c_[k];
  }
}

double Taylor::integral(double s) const {
  Series c = c_;
  for (std::size_t k = 0; k < c.size(); ++k) c[k] /= static_cast<double>(k + 1);
  return s * sum_of_powers(c, s, 0, order_);
}

double Taylor::integral_2(double s) const {
  Series c = c_;
  for (std::size_t k = 0; k < c.size(); ++k) c[k] /= static_cast<double>((k + 1) * (k + 2));
  return s * s * sum_of_powers(c, s, 0, order_);
}

double Taylor::squared_rate_integral(double s) const {
  std::array<double, std::size_t{2} * max_order> square{};
  const std::size_t n = static_cast<std::size_t>(order_);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) square[i + j + 1] += rate_[i] * rate_[j] / static_cast<double>(i + j + 1);
  return sum_of_powers(square, s, 1, 2 * order_ - 1);
}

}  // namespace spring
