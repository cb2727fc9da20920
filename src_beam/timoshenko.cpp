#include "timoshenko.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
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

Timoshenko::Timoshenko(const Parameters& p)
    : n_(p.n_elements),
      p_(p.element_degree),
      h_(p.length / p.n_elements),
      top_(p.mass_matrix == MassMatrix::averaged ? 2.0 : 1.0),
      mu_(p.density * p.area),
      r_(std::sqrt(p.second_moment_of_area / p.area)),
      b_(p.young_modulus / p.density),
      b_top_(b_),
      s_(p.shear_modulus * p.shear_coefficient / p.density),
      length_(p.length),
      point_force_position_(p.point_force_position) {
  if (!p.reduced_integration) b_top_ += s_ * (h_ / r_) * (h_ / r_) / (4.0 * static_cast<double>(4 * p_ * p_ - 1));
  // Each factor may be harmless and the product still leave the range of a double.
  const std::pair<const char*, double> products[] = {{"length / n_elements", h_},
                                                     {"density * area", mu_},
                                                     {"second_moment_of_area / area", r_},
                                                     {"young_modulus / density", b_},
                                                     {"the bending stiffness of an element", b_top_},
                                                     {"shear_modulus * shear_coefficient / density", s_}};
  for (const auto& [name, value] : products) {
    if (!std::isnormal(value))
      throw std::invalid_argument(std::string("beam: ") + name + " leaves the range of floating-point numbers");
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

// Of the element where this field's unknowns, every other one, begin at x[first]. With N_k = (P_k − P_{k−2})/(2k−1).
template <typename Degree>
Timoshenko::Legendre Timoshenko::coefficients(Degree p, const double* x, Index first) {
  const double* q = x + first;
  const double left = at_node(x, first - 2), right = q[2 * p - 2];
  Legendre c;
  c[0] = 0.5 * (left + right);
  c[1] = 0.5 * (right - left);
  for (Index k = 2; k <= p; ++k) {
    c[k] = q[2 * k - 4] / static_cast<double>(2 * k - 1);
    c[k - 2] -= c[k];
  }
  return c;
}

// The transpose of it: adds what has these moments with P_0, …, P_p in the element.
template <typename Degree>
void Timoshenko::add_moments(Degree p, const Legendre& moment, double* y, Index first) {
  double* q = y + first;
  if (first >= 2) *(q - 2) += 0.5 * (moment[0] - moment[1]);
  for (Index k = 2; k <= p; ++k) q[2 * k - 4] += (moment[k] - moment[k - 2]) / static_cast<double>(2 * k - 1);
  q[2 * p - 2] += 0.5 * (moment[0] + moment[1]);
}

// The transpose of strains(), of stresses by the same names.
template <typename Degree>
void Timoshenko::add_stresses(Degree p, const Strains& s, double* y, Index first) const {
  double* q = y + first;
  const double lever = 0.5 * h_ / r_, shear = s.gamma[0];
  const double moment = p > 1 ? s.h_kappa[0] - lever * s.gamma[1] : s.h_kappa[0];
  if (first > 0) {
    *(q - 2) -= moment + lever * shear;
    *(q - 1) -= shear;
  }
  for (Index k = 2; k <= p; ++k) {
    const double jump = k < p ? s.gamma[k - 2] - s.gamma[k] : s.gamma[k - 2];
    q[2 * k - 4] += 2.0 * s.h_kappa[k - 1] + 2.0 * lever / static_cast<double>(2 * k - 1) * jump;
    q[2 * k - 3] += 2.0 * s.gamma[k - 1];
  }
  q[2 * p - 2] += moment - lever * shear;
  q[2 * p - 1] += shear;
}

void Timoshenko::add_mass_times(double a, const double* x, double* __restrict y) const {
  with_degree([=](auto p) {
    for (Index i = 0; i < size(); i += 2 * p) {
      for (const Index first : {i, i + 1}) {
        Legendre c = coefficients(p, x, first);
        for (Index j = 0; j <= p; ++j) c[j] *= a * mass_weight(p, j);
        add_moments(p, c, y, first);
      }
    }
  });
}

void Timoshenko::add_stiffness_times(double c, const double* x, double* __restrict y) const {
  with_degree([=](auto p) {
    for (Index i = 0; i < size(); i += 2 * p) {
      Strains s = strains(p, x, i);
      stress(p, c, s);
      add_stresses(p, s, y, i);
    }
  });
}

template <typename Degree>
void Timoshenko::stress(Degree p, double c, Strains& s) const {
  for (Index j = 0; j < p; ++j) {
    const double legendre = static_cast<double>(2 * j + 1);
    s.h_kappa[j] *= c * bending_stiffness(p, j) / (h_ * legendre);
    s.gamma[j] *= c * s_ / legendre;
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
    double sum = 0.0;
    for (Index i = 0; i < size(); i += 2 * p) {
      const Legendre t = coefficients(p, x, i), u = coefficients(p, x, i + 1);
      for (Index j = 0; j <= p; ++j) sum += mass_weight(p, j) * (t[j] * t[j] + u[j] * u[j]);
    }
    return sum;
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
Eigen::SparseMatrix<double> Timoshenko::assemble(const Eigen::MatrixXd& element) const {
  std::vector<Eigen::Triplet<double>> entries;
  const Index local = element.rows();
  entries.reserve(static_cast<std::size_t>(n_ * local * (local + 1) / 2));
  for (Index e = 0; e < n_; ++e) {
    const Index first = 2 * (e * p_ - 1);
    for (Index i = 0; i < local; ++i) {
      for (Index j = std::max<Index>(0, -first); j <= i; ++j) {
        entries.emplace_back(static_cast<int>(first + i), static_cast<int>(first + j), element(i, j));
      }
    }
  }
  Eigen::SparseMatrix<double> A(size(), size());
  A.setFromTriplets(entries.begin(), entries.end());
  return A;
}

// Column by column, of an element behind a node.
Eigen::SparseMatrix<double> Timoshenko::mass() const {
  const Index local = 2 * (p_ + 1);
  Eigen::MatrixXd unit = Eigen::MatrixXd::Identity(local, local), element = Eigen::MatrixXd::Zero(local, local);
  for (Index i = 0; i < local; ++i) {
    Legendre c = coefficients(p_, unit.col(i).data(), 2 + i % 2);
    for (Index j = 0; j <= p_; ++j) c[j] *= mass_weight(p_, j);
    add_moments(p_, c, element.col(i).data(), 2 + i % 2);
  }
  return assemble(element);
}

Eigen::SparseMatrix<double> Timoshenko::stiffness() const {
  const Index local = 2 * (p_ + 1);
  Eigen::MatrixXd unit = Eigen::MatrixXd::Identity(local, local), element = Eigen::MatrixXd::Zero(local, local);
  for (Index i = 0; i < local; ++i) {
    Strains s = strains(p_, unit.col(i).data(), 2);
    stress(p_, 1.0, s);
    add_stresses(p_, s, element.col(i).data(), 2);
  }
  return assemble(element);
}

Eigen::VectorXd Timoshenko::unit_tip_force() const { return Eigen::VectorXd::Unit(size(), tip_index()); }

// By its moments with P_0, P_1, … in each element. There (x/L)^i = Σ a_j P_j(ξ), found from x/L = (e + ½ + ξ/2)/n and
// ξ P_j = ((j+1) P_{j+1} + j P_{j−1})/(2j+1), and ∫P_j² dx = h/(2j+1).
Eigen::VectorXd Timoshenko::load(std::size_t shape) const {
  Eigen::VectorXd F = Eigen::VectorXd::Zero(size());
  const auto add = [&](Index e, const Legendre& moment) { add_moments(p_, moment, F.data(), 2 * p_ * e + 1); };
  const double count = static_cast<double>(n_);
  if (shape == Loads::hat) {
    add(n_ - 1, {h_ / 2.0, h_ / 6.0});
  } else if (shape >= Loads::point && shape <= Loads::tip) {
    const double place = position(shape) * count;
    const Index e = std::min(static_cast<Index>(place), n_ - 1);
    add(e, legendre(2.0 * (place - static_cast<double>(e)) - 1.0));
  } else {
    const std::size_t power = shape < Loads::point ? shape : 0;
    for (Index e = 0; e < n_; ++e) {
      Legendre moment{};
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
      add(e, moment);
    }
    if (shape == Loads::base_acceleration) F *= -mu_;
  }
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
    const Legendre theta = coefficients(p_, a, 2 * p_ * e), u = coefficients(p_, a, 2 * p_ * e + 1);
    double right = 1.0;  // part of the element that is left
    while (right > 0.0) {
      // x_next, from this element's left end
      const double place = static_cast<double>(next * n_ - e * intervals) / static_cast<double>(intervals);
      const bool inside = next >= 0 && place >= 0.0;
      const double left = inside ? place : 0.0, size = h_ * (right - left);
      double force = 0.0, lever = 0.0, turn = 0.0;  // ∫u, ∫(s − x_left) u, ∫θ̃
      at_gauss_points([&](double part, double weight) {
        const Legendre P = legendre(2.0 * (left + part * (right - left)) - 1.0);
        const double value = size * weight * sum(u, P);
        force += value;
        lever += size * part * value;
        turn += size * weight * sum(theta, P);
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

Timoshenko::Legendre Timoshenko::legendre(double xi) const {
  Legendre P;
  P[0] = 1.0;
  P[1] = xi;
  for (Index k = 2; k <= p_; ++k) {
    const double degree = static_cast<double>(k);
    P[k] = ((2.0 * degree - 1.0) * xi * P[k - 1] - (degree - 1.0) * P[k - 2]) / degree;
  }
  return P;
}

double Timoshenko::sum(const Legendre& c, const Legendre& P) const {
  double value = 0.0;
  for (Index j = 0; j <= p_; ++j) value += c[j] * P[j];
  return value;
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
      Q = position(shape) >= X ? 1.0 : 0.0;
      M = std::max(0.0, position(shape) - X) * L;
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

void Timoshenko::sample(const double* q, int field, double* values) const {
  constexpr Index intervals = shape_points - 1;
  for (Index j = 0; j <= intervals; ++j) {
    const Index e = j * n_ / intervals;  // its left node is at x_j or left of it
    const double part = static_cast<double>(j * n_ % intervals) / static_cast<double>(intervals);
    const Index first = 2 * p_ * e + field;
    values[j] = part == 0.0 ? at_node(q, first - 2) : sum(coefficients(p_, q, first), legendre(2.0 * part - 1.0));
  }
}

}  // namespace beam
