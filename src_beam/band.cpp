#include "band.hpp"

#include <algorithm>
#include <limits>
#include <type_traits>
#include <utility>

namespace beam {

using Eigen::Index;

BandFactors::BandFactors(Eigen::MatrixXd rows) : rows_(std::move(rows)) {
  const Index width = rows_.rows() - 1;
  Eigen::VectorXd scaled(width + 1);  // a row of L times D
  for (Index i = 0; i < rows_.cols(); ++i) {
    double pivot = rows_(0, i);
    const Index before = std::min(i, width);
    for (Index k = before; k > 0; --k) {
      scaled[k] = rows_(k, i);
      for (Index m = before; m > k; --m) scaled[k] -= rows_(m - k, i - k) * scaled[m];
      rows_(k, i) = scaled[k] * rows_(0, i - k);
      pivot -= scaled[k] * rows_(k, i);
    }
    rows_(0, i) = pivot > 0.0 ? 1.0 / pivot : std::numeric_limits<double>::quiet_NaN();
  }
}

void BandFactors::solve_in_place(Eigen::VectorXd& x) const {
  // The compiler knows the width of linear elements.
  rows_.rows() == 4 ? sweep(std::integral_constant<Index, 3>(), x.data()) : sweep(rows_.rows() - 1, x.data());
}

template <typename Width>
void BandFactors::sweep(Width width, double* x) const {
  const Index n = rows_.cols();
  const double* row = rows_.data();
  for (Index i = 0; i < n; ++i, row += width + 1) {
    double value = x[i];
    for (Index k = width; k > 0; --k)  // what is waited for comes last
      if (k <= i) value -= row[k] * x[i - k];
    x[i] = value;
  }
  for (Index i = n - 1; i >= 0; --i) {
    row -= width + 1;
    double value = x[i] * row[0];
    for (Index k = width; k > 0; --k)
      if (k < n - i) value -= row[k * (width + 2)] * x[i + k];
    x[i] = value;
  }
}

}  // namespace beam
