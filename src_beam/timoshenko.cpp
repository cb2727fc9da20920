#include "timoshenko.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "gauss.hpp"

namespace beam {

using Eigen::Index;

namespace {

/// An unknown of a node; the clamp is before the first.
double at_node(const double* x, Index i) { return i >= 0 ? x[i] : 0.0; }

}  // namespace

/// Legendre coefficients of an element's strains, j < p: h κ_j [m] and γ_j [–].
struct Timoshenko::Strains {
  std::array<double, max_element_degree> h_kappa, gamma;
};

/// One field of an element: the end values of its linear part P_0, P_1, and its coefficients f_j of P_j, 2 ≤ j ≤ p.
/// ∫f² dx = h/6 (l² + r² + (l + r)²) + Σ h/(2j+1) f_j², its consistent mass.
struct Timoshenko::Field {
  double left, right;
  std::array<double, max_element_degree + 1> f;
};

Timoshenko::Timoshenko(const Parameters& p)
    : n_(p.n_elements),
      p_(p.element_degree),
      h_(p.length / p.n_elements),
      top_(p.mass_matrix == MassMatrix::averaged ? 2.0 : 1.0),
      end_(p_ == 1 && top_ == 2.0 ? h_ / 12.0 : h_ / 6.0),
      ratio_(p_ == 1 && top_ == 2.0 ? 5.0 : 2.0),
      mu_(p.density * p.area),
      r_(std::sqrt(p.second_moment_of_area / p.area)),
      b_(p.young_modulus / p.density),
      b_top_(b_),
      s_(p.shear_modulus * p.shear_coefficient / p.density),
      length_(p.length),
      point_force_position_(p.point_force_position) {
  if (!p.reduced_integration) b_top_ += s_ * (h_ / r_) * (h_ / r_) / (4.0 * static_cast<double>(4 * p_ * p_ - 1));
  for (const double value : {h_, mu_, r_, b_, b_top_, s_}) {
    if (!std::isnormal(value)) {
      throw std::invalid_argument(
          "beam: the parameters leave the range of floating-point numbers (length, density, "
          "area, moduli or their ratios)");
    }
  }
}

// Of the element whose bubbles and right node begin at x[first]; its left node is before them, or it is the clamp.
template <typename Degree>
Timoshenko::Strains Timoshenko::strains(Degree p, const double* x, Index first) const {
  const double* q = x + first;
  const double half = 0.5 / r_, theta0 = at_node(x, first - 2), theta1 = q[2 * p - 2];
  const double u0 = at_node(x, first - 1), u1 = q[2 * p - 1];
  Strains s;
  s.h_kappa[0] = theta1 - theta0;
  s.gamma[0] = (u1 - u0) / h_ - half * (theta0 + theta1);
  for (Index k = 2; k <= p; ++k) {
    s.h_kappa[k - 1] = 2.0 * q[2 * k - 4];
    s.gamma[k - 1] = 2.0 * q[2 * k - 3] / h_;
  }
  if (p > 1) s.gamma[1] -= half * (theta1 - theta0);
  for (Index k = 2; k <= p; ++k) {
    const double slope = q[2 * k - 4] / (static_cast<double>(2 * k - 1) * r_);
    s.gamma[k - 2] += slope;
    if (k < p) s.gamma[k] -= slope;
  }
  return s;
}

// Of the element where this field's unknowns, every other one, begin at x[first].
template <typename Degree>
Timoshenko::Field Timoshenko::field(Degree p, const double* x, Index first) const {
  const double* q = x + first;
  Field v;
  v.left = at_node(x, first - 2);
  v.right = q[2 * p - 2];
  for (Index k = 2; k <= p; ++k) {
    const double part = q[2 * k - 4] / static_cast<double>(2 * k - 1);
    v.f[k] = part;
    if (k == 2) {
      v.left -= part;
      v.right -= part;
    } else if (k == 3) {
      v.left += part;
      v.right -= part;
    } else {
      v.f[k - 2] -= part;
    }
  }
  return v;
}

void Timoshenko::mass_times(const double* x, double* __restrict y) const {
  with_degree([=](auto p) {
    const Index block = 2 * p;
    for (Index f = 0; f < 2; ++f) {
      double l = 0.0, r = 0.0;  // linear part of the element to the left
      for (Index e = 0; e < n_; ++e) {
        double* out = y + e * block + f;
        const Field v = field(p, x, e * block + f);
        if (e > 0) *(out - 2) = end_ * (l + ratio_ * (r + v.left) + v.right);
        l = v.left;
        r = v.right;
        // Moments of the field with P_j: with P_0 and P_1 from the ends, with the others h f_j/(2j+1).
        std::array<double, max_element_degree + 1> moment;
        moment[0] = 3.0 * end_ * (l + r);
        moment[1] = end_ * (r - l);
        for (Index k = 2; k <= p; ++k) {
          moment[k] = (k < p ? h_ : h_ * top_) * v.f[k] / static_cast<double>(2 * k + 1);
          out[2 * k - 4] = (moment[k] - moment[k - 2]) / static_cast<double>(2 * k - 1);
        }
      }
      y[(n_ - 1) * block + f + block - 2] = end_ * (l + ratio_ * r);
    }
  });
}

void Timoshenko::stiffness_times(const double* x, double* __restrict y) const {
  with_degree([=](auto p) {
    const double lever = 0.5 * h_ / r_;
    const Index block = 2 * p;
    double moment = 0.0, shear = 0.0;  // of the element to the left
    for (Index e = 0; e < n_; ++e) {
      double* out = y + e * block;
      Strains s = strains(p, x, e * block);
      for (Index j = 0; j < p; ++j) {  // strains become stresses
        const double legendre = static_cast<double>(2 * j + 1);
        s.h_kappa[j] *= bending_stiffness(p, j) / (h_ * legendre);
        s.gamma[j] *= s_ / legendre;
      }
      const double moment1 = p > 1 ? s.h_kappa[0] - lever * s.gamma[1] : s.h_kappa[0], shear1 = s.gamma[0];
      if (e > 0) {
        *(out - 2) = (moment - moment1) - lever * (shear + shear1);
        *(out - 1) = shear - shear1;
      }
      for (Index k = 2; k <= p; ++k) {
        const double jump = k < p ? s.gamma[k - 2] - s.gamma[k] : s.gamma[k - 2];
        out[2 * k - 4] = 2.0 * s.h_kappa[k - 1] + 2.0 * lever / static_cast<double>(2 * k - 1) * jump;
        out[2 * k - 3] = 2.0 * s.gamma[k - 1];
      }
      moment = moment1;
      shear = shear1;
    }
    y[tip_rotation_index()] = moment - lever * shear;
    y[tip_index()] = shear;
  });
}

void Timoshenko::add_linear_products(double a, const double* x, double c, const double* z, double* __restrict y) const {
  const double m = a * end_, lever = 0.5 * h_ / r_, bend = c * b_top_ / h_, slide = c * s_;
  double moment = 0.0, shear = 0.0;  // of the element to the left
  for (Index i = 0; i < size(); i += 2) {
    const Strains s = strains(Linear(), z, i);
    const double moment1 = bend * s.h_kappa[0], shear1 = slide * s.gamma[0];
    if (i > 0) {
      y[i - 2] +=
          m * (at_node(x, i - 4) + 2.0 * ratio_ * x[i - 2] + x[i]) + ((moment - moment1) - lever * (shear + shear1));
      y[i - 1] += m * (at_node(x, i - 3) + 2.0 * ratio_ * x[i - 1] + x[i + 1]) + (shear - shear1);
    }
    moment = moment1;
    shear = shear1;
  }
  const Index turn = tip_rotation_index(), tip = tip_index();
  y[turn] += m * (at_node(x, turn - 2) + ratio_ * x[turn]) + (moment - lever * shear);
  y[tip] += m * (at_node(x, tip - 2) + ratio_ * x[tip]) + shear;
}

void Timoshenko::add_products(double a, const Eigen::VectorXd& x, double c, const Eigen::VectorXd& z,
                              Eigen::VectorXd& y) const {
  if (p_ == 1) {
    add_linear_products(a, x.data(), c, z.data(), y.data());
  } else {
    y += a * mass_times(x) + c * stiffness_times(z);
  }
}

void Timoshenko::flexibility_times(const double* x, double* y) const {
  // Equilibrium from the tip: y holds the stresses of each element, (M_j, S_j) for j = 1 … p − 1, then for j = 0.
  const double lever = 0.5 * h_ / r_;
  const Index block = 2 * p_;
  double moment = 0.0, shear = 0.0;
  for (Index e = n_ - 1; e >= 0; --e) {
    const double* load = x + e * block;
    double* stress = y + e * block;
    const double shear1 = shear + load[block - 1];
    moment += load[block - 2] + lever * (shear + shear1);
    shear = shear1;
    stress[block - 2] = moment;
    stress[block - 1] = shear;
    for (Index k = 2; k <= p_; ++k) stress[2 * k - 3] = 0.5 * load[2 * k - 3];
    for (Index k = 2; k <= p_; ++k) {
      double jump = k > 2 ? stress[2 * k - 5] : shear;
      if (k < p_) jump -= stress[2 * k - 1];
      stress[2 * k - 4] = 0.5 * load[2 * k - 4] - lever / static_cast<double>(2 * k - 1) * jump;
    }
    if (p_ > 1) stress[block - 2] += lever * stress[1];
  }
  // Strains and displacements from the clamp.
  const double bend = h_ / bending_stiffness(p_, 0), slide = h_ / s_;
  double theta0 = 0.0, u0 = 0.0;
  for (Index e = 0; e < n_; ++e) {
    double* q = y + e * block;
    const double theta1 = theta0 + bend * q[block - 2];
    u0 += slide * q[block - 1] + lever * (theta0 + theta1);
    for (Index k = 2; k <= p_; ++k) {
      const double legendre = static_cast<double>(2 * k - 1);
      q[2 * k - 4] *= 0.5 * h_ * legendre / bending_stiffness(p_, k - 1);
      q[2 * k - 3] *= 0.5 * slide * legendre;
    }
    if (p_ > 1) {
      u0 -= 2.0 * lever / 3.0 * q[0];
      q[1] += 0.5 * lever * (theta1 - theta0);
    }
    for (Index k = 2; k <= p_; ++k) {
      const double slope = lever * q[2 * k - 4] / static_cast<double>(2 * k - 1);
      if (k > 2) q[2 * k - 5] -= slope;
      if (k < p_) q[2 * k - 1] += slope;
    }
    theta0 = theta1;
    q[block - 2] = theta0;
    q[block - 1] = u0;
  }
}

void Timoshenko::weighted_strains(const double* x, double* out) const {
  for (Index i = 0; i < size(); i += 2 * p_) {
    const Strains s = strains(p_, x, i);
    for (Index j = 0; j < p_; ++j) {
      const double legendre = static_cast<double>(2 * j + 1);
      out[i + 2 * j] = std::sqrt(bending_stiffness(p_, j) / (h_ * legendre)) * s.h_kappa[j];
      out[i + 2 * j + 1] = std::sqrt(s_ * h_ / legendre) * s.gamma[j];
    }
  }
}

Eigen::VectorXd Timoshenko::mass_solve(const Eigen::VectorXd& x) const {
  const MassFactor factor(mass());
  require_factor(factor);
  return factor.solve(x);
}

void require_factor(const Timoshenko::MassFactor& factor) {
  if (factor.info() != Eigen::Success) throw std::runtime_error("beam: the mass matrix cannot be factorised");
}

double Timoshenko::mass_norm2(const Eigen::VectorXd& q) const {
  return with_degree([this, x = q.data()](auto p) {
    double linear = 0.0, rest = 0.0;
    for (Index i = 0; i < size(); i += 2 * p) {
      const Field t = field(p, x, i), u = field(p, x, i + 1);
      for (const Field& f : {t, u}) {
        linear += (ratio_ - 1.0) * (f.left * f.left + f.right * f.right) + (f.left + f.right) * (f.left + f.right);
      }
      for (Index j = 2; j <= p; ++j) {
        rest += (j < p ? 1.0 : top_) * (t.f[j] * t.f[j] + u.f[j] * u.f[j]) / static_cast<double>(2 * j + 1);
      }
    }
    return linear * end_ + h_ * rest;
  });
}

double Timoshenko::stiffness_norm2(const Eigen::VectorXd& q) const {
  return with_degree([this, x = q.data()](auto p) {
    double bend = 0.0, top = 0.0, shear = 0.0;
    for (Index i = 0; i < size(); i += 2 * p) {
      const Strains s = strains(p, x, i);
      for (Index j = 0; j < p; ++j) {
        const double kappa = s.h_kappa[j] / h_, legendre = static_cast<double>(2 * j + 1);
        (j + 1 < p ? bend : top) += kappa * kappa / legendre;
        shear += s.gamma[j] * s.gamma[j] / legendre;
      }
    }
    return h_ * (b_ * bend + b_top_ * top + s_ * shear);
  });
}

// All entries of every element, also where they are 0: M and K have one pattern.
template <typename Entry>
Eigen::SparseMatrix<double> Timoshenko::assemble(const Entry& entry) const {
  std::vector<Eigen::Triplet<double>> entries;
  const Index local = 2 * (p_ + 1);
  entries.reserve(static_cast<std::size_t>(n_ * local * (local + 1) / 2));
  for (Index e = 0; e < n_; ++e) {
    const Index first = 2 * (e * p_ - 1);
    for (Index i = 0; i < local; ++i) {
      for (Index j = 0; j <= i; ++j) {
        if (first + j >= 0) {
          entries.emplace_back(static_cast<int>(first + i), static_cast<int>(first + j), entry(i, j));
        }
      }
    }
  }
  Eigen::SparseMatrix<double> A(size(), size());
  A.setFromTriplets(entries.begin(), entries.end());
  return A;
}

Eigen::SparseMatrix<double> Timoshenko::mass() const {
  // Of one field over (left node, bubbles, right node), column by column.
  Eigen::MatrixXd element(p_ + 1, p_ + 1);
  for (Index j = 0; j <= p_; ++j) {
    const Eigen::VectorXd unit = Eigen::VectorXd::Unit(2 * (p_ + 1), 2 * j);
    const Field v = field(p_, unit.data(), 2);
    element(0, j) = end_ * (ratio_ * v.left + v.right);
    element(p_, j) = end_ * (v.left + ratio_ * v.right);
    double below[2] = {3.0 * end_ * (v.left + v.right), end_ * (v.right - v.left)};
    for (Index k = 2; k <= p_; ++k) {
      const double moment = (k < p_ ? h_ : h_ * top_) * v.f[k] / static_cast<double>(2 * k + 1);
      element(k - 1, j) = (moment - below[k % 2]) / static_cast<double>(2 * k - 1);
      below[k % 2] = moment;
    }
  }
  return assemble([&](Index i, Index j) { return i % 2 == j % 2 ? element(i / 2, j / 2) : 0.0; });
}

Eigen::SparseMatrix<double> Timoshenko::stiffness() const {
  std::vector<Strains> columns;
  for (Index i = 0; i < 2 * (p_ + 1); ++i) {
    const Eigen::VectorXd unit = Eigen::VectorXd::Unit(2 * (p_ + 1), i);
    columns.push_back(strains(p_, unit.data(), 2));
  }
  return assemble([&](Index i, Index j) {
    const Strains &a = columns[i], &b = columns[j];
    double sum = 0.0;
    for (Index k = 0; k < p_; ++k) {
      const double bend = bending_stiffness(p_, k) * (a.h_kappa[k] / h_) * (b.h_kappa[k] / h_);
      sum += h_ / static_cast<double>(2 * k + 1) * (bend + s_ * a.gamma[k] * b.gamma[k]);
    }
    return sum;
  });
}

Eigen::VectorXd Timoshenko::unit_tip_force() const { return Eigen::VectorXd::Unit(size(), tip_index()); }

Eigen::VectorXd Timoshenko::load(std::size_t shape) const {
  if (shape < Loads::point) return distributed_load(shape - Loads::distributed);
  if (shape < Loads::tip) return point_force(point_force_position_[shape - Loads::point]);
  if (shape == Loads::tip) return unit_tip_force();
  return shape == Loads::base_acceleration ? Eigen::VectorXd(-mu_ * distributed_load(0)) : hat_load();
}

// In an element (x/L)^power = Σ a_j P_j(ξ), found from x/L = (e + ½ + ξ/2)/n and ξ P_j = ((j+1) P_{j+1} + j
// P_{j−1})/(2j+1). Its moments with the hats and N_k = (P_k − P_{k−2})/(2k−1) follow from ∫P_j² dx = h/(2j+1).
Eigen::VectorXd Timoshenko::distributed_load(std::size_t power) const {
  Eigen::VectorXd F = Eigen::VectorXd::Zero(size());
  const double count = static_cast<double>(n_);
  for (Index e = 0; e < n_; ++e) {
    std::array<double, max_element_degree + 1> moment{};
    moment[0] = 1.0;
    for (std::size_t k = 0; k < power; ++k) {
      const auto a = moment;
      for (std::size_t j = 0; j <= k + 1; ++j) {
        const double degree = static_cast<double>(j);
        moment[j] = (static_cast<double>(e) + 0.5) / count * a[j] +
                    (degree + 1.0) / (2.0 * degree + 3.0) * a[j + 1] / (2.0 * count);
        if (j > 0) moment[j] += degree / (2.0 * degree - 1.0) * a[j - 1] / (2.0 * count);
      }
    }
    for (std::size_t j = 0; j <= power; ++j) moment[j] *= h_ / static_cast<double>(2 * j + 1);
    double* q = F.data() + 2 * p_ * e;
    if (e > 0) *(q - 1) += 0.5 * (moment[0] - moment[1]);
    q[2 * p_ - 1] = 0.5 * (moment[0] + moment[1]);
    for (Index k = 2; k <= p_; ++k) q[2 * k - 3] = (moment[k] - moment[k - 2]) / static_cast<double>(2 * k - 1);
  }
  return F;
}

Eigen::VectorXd Timoshenko::point_force(double position) const {
  Eigen::VectorXd F = Eigen::VectorXd::Zero(size());
  const double place = position * static_cast<double>(n_);
  const Index e = std::min(static_cast<Index>(place), n_ - 1);
  const ShapeFunctions N = shape_functions(place - static_cast<double>(e));
  double* q = F.data() + 2 * p_ * e;
  if (e > 0) *(q - 1) = N[0];
  q[2 * p_ - 1] = N[1];
  for (Index k = 2; k <= p_; ++k) q[2 * k - 3] = N[k];
  return F;
}

Eigen::VectorXd Timoshenko::hat_load() const {
  Eigen::VectorXd F = Eigen::VectorXd::Zero(size());
  F[tip_index()] = h_ / 3.0;
  if (n_ > 1) F[tip_index() - 2 * p_] = h_ / 6.0;
  const Index last = size() - 2 * p_;
  if (p_ > 1) F[last + 1] = -h_ / 6.0;
  if (p_ > 2) F[last + 3] = -h_ / 30.0;
  return F;
}

Eigen::VectorXd Timoshenko::linear_shape() const {
  Eigen::VectorXd q = Eigen::VectorXd::Zero(size());
  for (Index e = 1; e <= n_; ++e) q[2 * p_ * e - 1] = static_cast<double>(e) * h_;
  return q;
}

InternalForces Timoshenko::inertia(const double* a) const {
  InternalForces forces;
  double shear = 0.0, moment = 0.0;  // about the point reached, from the tip on
  constexpr Index intervals = shape_points - 1;
  Index next = intervals - 1;  // output point
  for (Index e = n_ - 1; e >= 0; --e) {
    const Field theta = field(p_, a, 2 * p_ * e), u = field(p_, a, 2 * p_ * e + 1);
    double right = 1.0;  // part of the element that is left
    while (right > 0.0) {
      // x_next, from this element's left end
      const double place = static_cast<double>(next * n_ - e * intervals) / static_cast<double>(intervals);
      const bool inside = next >= 0 && place >= 0.0;
      const double left = inside ? place : 0.0, size = h_ * (right - left);
      double force = 0.0, lever = 0.0, turn = 0.0;  // ∫u, ∫(s − x_left) u, ∫θ̃
      at_gauss_points([&](double part, double weight) {
        const double xi = 2.0 * (left + part * (right - left)) - 1.0, value = size * weight * legendre_sum(u, xi);
        force += value;
        lever += size * part * value;
        turn += size * weight * legendre_sum(theta, xi);
      });
      moment += size * shear + mu_ * (lever + r_ * turn);
      shear += mu_ * force;
      right = left;
      if (!inside) break;
      forces.shear[static_cast<std::size_t>(next)] = shear;
      forces.moment[static_cast<std::size_t>(next)] = moment;
      --next;
    }
  }
  return forces;
}

double Timoshenko::legendre_sum(const Field& v, double xi) const {
  double sum = 0.5 * (v.left * (1.0 - xi) + v.right * (1.0 + xi)), before = 1.0, legendre = xi;
  for (Index k = 2; k <= p_; ++k) {
    const double degree = static_cast<double>(k);
    const double next = ((2.0 * degree - 1.0) * xi * legendre - (degree - 1.0) * before) / degree;
    sum += v.f[k] * next;
    before = legendre;
    legendre = next;
  }
  return sum;
}

InternalForces Timoshenko::load_resultants(std::size_t shape) const {
  InternalForces forces;
  for (std::size_t j = 0; j < forces.shear.size(); ++j) {
    const double X = static_cast<double>(j) / (shape_points - 1), L = length_;  // x/L
    double &Q = forces.shear[j], &M = forces.moment[j];
    if (shape < Loads::point || shape == Loads::base_acceleration) {
      const double i = shape < Loads::point ? static_cast<double>(shape) : 0.0;
      const double scale = shape < Loads::point ? 1.0 : -mu_;
      const double whole = (1.0 - std::pow(X, i + 1.0)) / (i + 1.0);
      Q = scale * L * whole;
      M = scale * L * L * ((1.0 - std::pow(X, i + 2.0)) / (i + 2.0) - X * whole);
    } else if (shape == Loads::hat) {
      const double from = 1.0 - h_ / L, r = std::max(0.0, (X - from) * L / h_);  // part of the last element
      Q = h_ * (1.0 - r * r) / 2.0;
      M = h_ * h_ * ((1.0 - r * r * r) / 3.0 - r * (1.0 - r * r) / 2.0) + std::max(0.0, from - X) * L * Q;
    } else {
      const double position = shape == Loads::tip ? 1.0 : point_force_position_[shape - Loads::point];
      Q = position >= X ? 1.0 : 0.0;
      M = std::max(0.0, position - X) * L;
    }
  }
  return forces;
}

InternalForces LoadResultants::of(Loads::Values loads, double tip_force) const {
  loads[Loads::tip] += tip_force;
  InternalForces sum;
  for (std::size_t i = 0; i < loads.size(); ++i) {
    if (loads[i] == 0.0) continue;
    for (std::size_t j = 0; j < sum.shear.size(); ++j) {
      sum.shear[j] += loads[i] * unit_[i].shear[j];
      sum.moment[j] += loads[i] * unit_[i].moment[j];
    }
  }
  return sum;
}

/// At a part of the element: of its left node, of its right node, N_2, …, N_p.
Timoshenko::ShapeFunctions Timoshenko::shape_functions(double part) const {
  ShapeFunctions N;
  N[0] = 1.0 - part;
  N[1] = part;
  const double xi = 2.0 * part - 1.0;
  double before = 1.0, legendre = xi;  // P_{k−2}, P_{k−1}
  for (Index k = 2; k <= p_; ++k) {
    const double degree = static_cast<double>(k);
    const double next = ((2.0 * degree - 1.0) * xi * legendre - (degree - 1.0) * before) / degree;
    N[k] = (next - before) / (2.0 * degree - 1.0);
    before = legendre;
    legendre = next;
  }
  return N;
}

void Timoshenko::sample(const double* q, int field, double* values) const {
  constexpr Index intervals = shape_points - 1;
  for (Index j = 0; j <= intervals; ++j) {
    const Index left = j * n_ / intervals;  // node at or left of x_j
    const double part = static_cast<double>(j * n_ % intervals) / static_cast<double>(intervals);
    const double* element = q + 2 * p_ * left + field;
    const double a = left > 0 ? *(element - 2) : 0.0;
    if (part == 0.0) {
      values[j] = a;
      continue;
    }
    const ShapeFunctions N = shape_functions(part);
    values[j] = a + part * (element[2 * p_ - 2] - a);
    for (Index k = 2; k <= p_; ++k) values[j] += element[2 * k - 4] * N[k];
  }
}

}  // namespace beam
