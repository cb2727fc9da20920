// LDLᵀ of a symmetric positive definite band matrix.
#pragma once

#include "eigen.hpp"

namespace beam {

class BandFactors {
 public:
  BandFactors() = default;
  /// Factors the matrix with A(i, i − k) in row k and column i. Where a pivot is not positive, solutions are not
  /// finite.
  explicit BandFactors(Eigen::MatrixXd rows);

  /// x becomes A⁻¹ x.
  void solve_in_place(Eigen::VectorXd& x) const;

 private:
  template <typename Width>
  void sweep(Width width, double* x) const;

  Eigen::MatrixXd rows_;  // 1/D, then L, in row k L(i, i − k)
};

}  // namespace beam
