#include "timoshenko.hpp"

#include <cmath>
#include <vector>

namespace beam {

Timoshenko::Timoshenko(const Parameters& p)
    : n_(p.n_elements),
      h_(p.length / p.n_elements),
      mu_(p.density * p.area),
      r_(std::sqrt(p.second_moment_of_area / p.area)),
      b_(p.young_modulus / p.density),
      s_(p.shear_modulus * p.shear_coefficient / p.density) {
  if (!p.reduced_integration) b_ += s_ * (h_ / r_) * (h_ / r_) / 12.0;
}

void Timoshenko::mass_times(const double* x, double* y) const {
  const double m = h_ / 6.0;
  double t0 = 0.0, u0 = 0.0;  // left neighbour; the clamp to begin with
  Eigen::Index i = 0;
  for (; i < 2 * n_ - 2; i += 2) {
    y[i] = m * (t0 + 4.0 * x[i] + x[i + 2]);
    y[i + 1] = m * (u0 + 4.0 * x[i + 1] + x[i + 3]);
    t0 = x[i];
    u0 = x[i + 1];
  }
  y[i] = m * (t0 + 2.0 * x[i]);
  y[i + 1] = m * (u0 + 2.0 * x[i + 1]);
}

void Timoshenko::stiffness_times(const double* x, double* y) const {
  const double half = 0.5 / r_, bend = b_ / h_, lever = 0.5 * h_ / r_;
  double t0 = 0.0, u0 = 0.0;
  double moment = 0.0, shear = 0.0;  // of the element to the left
  for (Eigen::Index i = 0; i < 2 * n_; i += 2) {
    const double t1 = x[i], u1 = x[i + 1];
    const double moment1 = bend * (t1 - t0);
    const double shear1 = s_ * ((u1 - u0) / h_ - half * (t0 + t1));
    if (i > 0) {
      y[i - 2] = (moment - moment1) - lever * (shear + shear1);
      y[i - 1] = shear - shear1;
    }
    moment = moment1;
    shear = shear1;
    t0 = t1;
    u0 = u1;
  }
  y[2 * n_ - 2] = moment - lever * shear;
  y[2 * n_ - 1] = shear;
}

void Timoshenko::flexibility_times(const double* x, double* y) const {
  // Equilibrium from the tip: y holds (moment, shear force) of the element left of each node.
  const double lever = 0.5 * h_ / r_;
  double moment = 0.0, shear = 0.0;
  for (Eigen::Index i = 2 * n_ - 2; i >= 0; i -= 2) {
    const double shear1 = shear + x[i + 1];
    moment += x[i] + lever * (shear + shear1);
    shear = shear1;
    y[i] = moment;
    y[i + 1] = shear;
  }
  // Strains and displacements from the clamp.
  const double bend = h_ / b_, slide = h_ / s_;
  double t0 = 0.0, u0 = 0.0;
  for (Eigen::Index i = 0; i < 2 * n_; i += 2) {
    const double t1 = t0 + bend * y[i];
    u0 += slide * y[i + 1] + lever * (t0 + t1);
    t0 = t1;
    y[i] = t0;
    y[i + 1] = u0;
  }
}

void Timoshenko::weighted_strains(const double* x, double* strains) const {
  const double half = 0.5 / r_, wb = std::sqrt(b_ / h_), ws = std::sqrt(s_ * h_);
  double t0 = 0.0, u0 = 0.0;
  for (Eigen::Index i = 0; i < 2 * n_; i += 2) {
    strains[i] = wb * (x[i] - t0);
    strains[i + 1] = ws * ((x[i + 1] - u0) / h_ - half * (t0 + x[i]));
    t0 = x[i];
    u0 = x[i + 1];
  }
}

void Timoshenko::mass_cholesky(Eigen::VectorXd& diagonal, Eigen::VectorXd& super) const {
  diagonal.resize(n_);
  super.resize(n_);  // the last entry is unused and zero
  const double off = h_ / 6.0;
  double left = 0.0;
  for (Eigen::Index i = 0; i < n_; ++i) {
    const double main = (i + 1 < n_ ? 4.0 : 2.0) * off;
    diagonal[i] = std::sqrt(main - left * left);
    left = super[i] = i + 1 < n_ ? off / diagonal[i] : 0.0;
  }
}

Eigen::VectorXd Timoshenko::mass_times(const Eigen::VectorXd& x) const {
  Eigen::VectorXd y(size());
  mass_times(x.data(), y.data());
  return y;
}

Eigen::VectorXd Timoshenko::stiffness_times(const Eigen::VectorXd& x) const {
  Eigen::VectorXd y(size());
  stiffness_times(x.data(), y.data());
  return y;
}

Eigen::VectorXd Timoshenko::flexibility_times(const Eigen::VectorXd& x) const {
  Eigen::VectorXd y(size());
  flexibility_times(x.data(), y.data());
  return y;
}

Eigen::VectorXd Timoshenko::mass_solve(const Eigen::VectorXd& x) const {
  Eigen::VectorXd d, l, y = x;
  mass_cholesky(d, l);
  for (Eigen::Index i = 0; i < n_; ++i) {
    for (Eigen::Index f = 0; f < 2; ++f) {
      if (i > 0) y[2 * i + f] -= l[i - 1] * y[2 * i - 2 + f];
      y[2 * i + f] /= d[i];
    }
  }
  for (Eigen::Index i = n_ - 1; i >= 0; --i) {
    for (Eigen::Index f = 0; f < 2; ++f) {
      if (i + 1 < n_) y[2 * i + f] -= l[i] * y[2 * i + 2 + f];
      y[2 * i + f] /= d[i];
    }
  }
  return y;
}

double Timoshenko::mass_norm2(const Eigen::VectorXd& x) const {
  // ∫ of the square of a linear function over an element: h (a² + ab + b²)/3, here as a sum of squares.
  double sum = 0.0, t0 = 0.0, u0 = 0.0;
  for (Eigen::Index i = 0; i < 2 * n_; i += 2) {
    const double t1 = x[i], u1 = x[i + 1];
    sum += (t0 * t0 + t1 * t1 + (t0 + t1) * (t0 + t1)) + (u0 * u0 + u1 * u1 + (u0 + u1) * (u0 + u1));
    t0 = t1;
    u0 = u1;
  }
  return sum * h_ / 6.0;
}

double Timoshenko::stiffness_norm2(const Eigen::VectorXd& x) const {
  const double half = 0.5 / r_;
  double bend = 0.0, shear = 0.0, t0 = 0.0, u0 = 0.0;
  for (Eigen::Index i = 0; i < 2 * n_; i += 2) {
    const double kappa = (x[i] - t0) / h_, gamma = (x[i + 1] - u0) / h_ - half * (t0 + x[i]);
    bend += kappa * kappa;
    shear += gamma * gamma;
    t0 = x[i];
    u0 = x[i + 1];
  }
  return h_ * (b_ * bend + s_ * shear);
}

Eigen::SparseMatrix<double> Timoshenko::mass() const {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(4 * static_cast<std::size_t>(n_));
  const double m = h_ / 6.0;
  for (int i = 0; i < 2 * n_; ++i) {
    entries.emplace_back(i, i, (i < 2 * n_ - 2 ? 4.0 : 2.0) * m);
    if (i >= 2) entries.emplace_back(i, i - 2, m);
  }
  Eigen::SparseMatrix<double> M(size(), size());
  M.setFromTriplets(entries.begin(), entries.end());
  return M;
}

Eigen::SparseMatrix<double> Timoshenko::stiffness() const {
  const double half = 0.5 / r_;
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(10 * static_cast<std::size_t>(n_));
  for (int e = 0; e < n_; ++e) {
    // κ and γ as rows over (θ̃₀, u₀, θ̃₁, u₁)
    const double kappa[4] = {-1.0 / h_, 0.0, 1.0 / h_, 0.0};
    const double gamma[4] = {-half, -1.0 / h_, -half, 1.0 / h_};
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j <= i; ++j) {
        const int row = 2 * (e - 1) + i, column = 2 * (e - 1) + j;
        if (column >= 0) entries.emplace_back(row, column, h_ * (b_ * kappa[i] * kappa[j] + s_ * gamma[i] * gamma[j]));
      }
    }
  }
  Eigen::SparseMatrix<double> K(size(), size());
  K.setFromTriplets(entries.begin(), entries.end());
  return K;
}

Eigen::VectorXd Timoshenko::unit_tip_force() const { return Eigen::VectorXd::Unit(size(), tip_index()); }

Eigen::VectorXd Timoshenko::uniform_load() const {
  Eigen::VectorXd F = Eigen::VectorXd::Zero(size());
  for (Eigen::Index i = 1; i < 2 * n_; i += 2) F[i] = h_;
  F[tip_index()] = 0.5 * h_;
  return F;
}

Eigen::VectorXd Timoshenko::hat_load() const {
  Eigen::VectorXd F = Eigen::VectorXd::Zero(size());
  F[tip_index()] = h_ / 3.0;
  if (n_ > 1) F[tip_index() - 2] = h_ / 6.0;
  return F;
}

Eigen::VectorXd Timoshenko::linear_shape() const {
  Eigen::VectorXd q = Eigen::VectorXd::Zero(size());
  for (Eigen::Index i = 0; i < n_; ++i) q[2 * i + 1] = static_cast<double>(i + 1) * h_;
  return q;
}

void Timoshenko::sample(const double* q, int field, double* values) const {
  constexpr Eigen::Index intervals = shape_points - 1;
  for (Eigen::Index j = 0; j <= intervals; ++j) {
    const Eigen::Index left = j * n_ / intervals;  // node at or left of x_j
    const double part = static_cast<double>(j * n_ % intervals) / static_cast<double>(intervals);
    const double a = left > 0 ? q[2 * (left - 1) + field] : 0.0;
    values[j] = part > 0.0 ? a + part * (q[2 * left + field] - a) : a;
  }
}

}  // namespace beam
