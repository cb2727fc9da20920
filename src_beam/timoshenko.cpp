#include "timoshenko.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "gauss.hpp"

namespace beam {

using Eigen::Dynamic;
using Eigen::Index;
using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The matrices of an element, of a size that the compiler knows where that is a linear one: its products take a third
/// of the time.
template <int P>
struct Timoshenko::Element {
  static constexpr int N = P == 1 ? 2 : Dynamic, D = N, most = P == 1 ? 1 : max_element_degree;
  using Field = Eigen::Matrix<double, N, 1, 0, most + 1, 1>;     // one of left node, bubbles, right node
  using Coefficients = Eigen::Matrix<double, P, 1, 0, most, 1>;  // one of P_0, …, P_{p−1}
  struct Fields {
    Field theta, u;
  };
  struct Strains {
    Coefficients h_kappa, h_gamma;
  };

  Eigen::Matrix<double, N, N, 0, most + 1, most + 1> mass;
  Eigen::Matrix<double, N, P, 0, most + 1, most> slope, shear;  // Sᵀ, and h/r Tᵀ but for its last coefficient
  using Own = Eigen::Matrix<double, D, 1, 0, 2 * most, 1>;      // of all unknowns but the left node's
  Strains weight;
  Own weights;                                                      // of all strains
  Eigen::Matrix<double, D, D, 0, 2 * most, 2 * most> from_strains;  // the unknowns of one that is clamped at its left

  explicit Element(const Timoshenko& mesh)
      : mass(mesh.mass_),
        slope(mesh.S_.transpose()),
        shear(mesh.h_ / mesh.r_ * mesh.T_.topRows(mesh.p_).transpose()),
        weight{mesh.weights_.row(0).transpose(), mesh.weights_.row(1).transpose()},
        weights(mesh.weights_.reshaped()),
        from_strains(mesh.from_strains_) {}

  Index p() const { return slope.cols(); }  // where it is known, to the compiler, too
  Fields of(const double* x, Index e) const { return {field(x, e), field(x + 1, e)}; }
  Field field(const double* x, Index e) const {
    using Stride = Eigen::InnerStride<2>;
    if (e > 0) return Map<const Field, 0, Stride>(x + 2 * (e * p() - 1), p() + 1);
    Field q(p() + 1);  // the clamp is its left node
    q << 0.0, Map<const Coefficients, 0, Stride>(x, p());
    return q;
  }
  // Products by coefficients: Eigen's others are made for larger matrices.
  Strains strains(const Fields& q) const {
    return {slope.transpose().lazyProduct(q.theta),
            slope.transpose().lazyProduct(q.u) - shear.transpose().lazyProduct(q.theta)};
  }
  /// m M v + k K q.
  Fields forces(double m, const Fields& v, double k, const Fields& q) const {
    const Strains s = strains(q);
    const Coefficients moment = k * weight.h_kappa.cwiseProduct(s.h_kappa),
                       force = k * weight.h_gamma.cwiseProduct(s.h_gamma);
    return {m * mass.lazyProduct(v.theta) + slope.lazyProduct(moment) - shear.lazyProduct(force),
            m * mass.lazyProduct(v.u) + slope.lazyProduct(force)};
  }
  /// y += what `forces(e)` does on the unknowns of each element e.
  template <typename Forces>
  void assemble(VectorXd& y, const Forces& forces) const {
    std::array<double, 2> node{};  // on the node between two elements, by the one before
    for (Index e = 0; 2 * e * p() < y.size(); ++e) {
      const Fields f = forces(e);
      for (const Index i : {0, 1}) {
        const Field& one = i == 0 ? f.theta : f.u;
        const Index own = 2 * e * p() + i;
        double& sum = node[static_cast<std::size_t>(i)];
        if (e > 0) y[own - 2] += sum + one[0];
        for (Index k = 1; k < p(); ++k) y[own + 2 * (k - 1)] += one[k];
        sum = one[p()];
      }
    }
    y[y.size() - 2] += node[0];
    y[y.size() - 1] += node[1];
  }
};

template <typename Use>
auto Timoshenko::with_element(const Use& use) const {
  return p_ == 1 ? use(Element<1>(*this)) : use(Element<Dynamic>(*this));
}

Timoshenko::Timoshenko(const Parameters& p)
    : parameters_(p),
      n_(p.n_elements),
      p_(p.element_degree),
      h_(p.length / p.n_elements),
      r_(std::sqrt(p.second_moment_of_area / p.area)),
      T_(MatrixXd::Zero(p_ + 1, p_ + 1)),
      S_(MatrixXd::Zero(p_, p_ + 1)),
      weights_(2, p_),
      from_strains_(2 * p_, 2 * p_) {
  const double mu = p.density * p.area, s = p.shear_modulus * p.shear_coefficient * p.area;
  const double b = p.young_modulus * p.area;
  double top = b;  // b_{p−1}
  if (!p.reduced_integration) top += s * (h_ / r_) * (h_ / r_) / (4.0 * static_cast<double>(4 * p_ * p_ - 1));
  // Each factor may be harmless and the product still leave the range of a double.
  const std::pair<const char*, double> products[] = {{"length / n_elements", h_},
                                                     {"density * area", mu},
                                                     {"second_moment_of_area / area", r_},
                                                     {"young_modulus * area", b},
                                                     {"the bending stiffness of an element", top},
                                                     {"shear_modulus * shear_coefficient * area", s}};
  for (const auto& [name, value] : products) {
    if (!std::isnormal(value))
      throw std::invalid_argument(std::string("beam: ") + name + " leaves the range of floating-point numbers");
  }

  T_(0, 0) = T_(0, p_) = T_(1, p_) = 0.5;
  T_(1, 0) = -0.5;
  S_(0, 0) = -1.0;
  S_(0, p_) = 1.0;
  for (Index k = 2; k <= p_; ++k) {
    T_(k, k - 1) = 1.0 / static_cast<double>(2 * k - 1);
    T_(k - 2, k - 1) = -T_(k, k - 1);
    S_(k - 1, k - 1) = 2.0;
  }
  VectorXd squares(p_ + 1);  // ∫ρA P_j² dx
  for (Index j = 0; j <= p_; ++j) {
    const double legendre = static_cast<double>(2 * j + 1);
    squares[j] = mu * h_ / legendre;
    if (j < p_) weights_.col(j) << (j + 1 < p_ ? b : top) / (h_ * legendre), s / (h_ * legendre);
  }
  if (p.mass_matrix == MassMatrix::averaged) squares[p_] *= 2.0;
  mass_ = T_.transpose() * squares.asDiagonal() * T_;

  // Its unknowns by the strains, first θ̃, then u, and the forces that these strains take, likewise.
  // Without its first column S is a permutation times factors: the inverse, transposed, has theirs in the same places.
  const MatrixXd from_slope = S_.rightCols(p_).unaryExpr([](double s) { return s == 0.0 ? 0.0 : 1.0 / s; });
  for (Index i = 0; i < 2 * p_; ++i) {
    MatrixXd strain = MatrixXd::Zero(2, p_);
    strain(i % 2, i / 2) = 1.0;
    Map<MatrixXd> q(from_strains_.col(i).data(), 2, p_);
    q.row(0) = strain.row(0) * from_slope;
    q.row(1) = (strain.row(1) + q.row(0) * (h_ / r_ * T_.topRightCorner(p_, p_).transpose())) * from_slope;
  }
  mass_factors_ = factors(1.0, 0.0);
}

void Timoshenko::add_products(double m, const Vector& v, double k, const Vector& q, VectorXd& y) const {
  with_element([&](const auto& element) {
    element.assemble(y,
                     [&](Index e) { return element.forces(m, element.of(v.data(), e), k, element.of(q.data(), e)); });
  });
}

VectorXd Timoshenko::mass_times(const Vector& q) const {
  VectorXd y = VectorXd::Zero(size());
  add_products(1.0, q, 0.0, q, y);
  return y;
}

VectorXd Timoshenko::stiffness_times(const Vector& q) const {
  VectorXd y = VectorXd::Zero(size());
  add_products(0.0, q, 1.0, q, y);
  return y;
}

MatrixXd Timoshenko::element(double m, double k) const {
  const Index local = 2 * (p_ + 1);
  MatrixXd matrix(local, local);
  const Element<Dynamic> one(*this);
  for (Index i = 0; i < local; ++i) {
    const VectorXd unit = VectorXd::Unit(local, i);
    const Map<const MatrixXd> fields(unit.data(), 2, p_ + 1);
    const Element<Dynamic>::Fields q{fields.row(0).transpose(), fields.row(1).transpose()};
    const auto f = one.forces(m, q, k, q);
    Map<MatrixXd>(matrix.col(i).data(), 2, p_ + 1) << f.theta.transpose(), f.u.transpose();
  }
  return matrix;
}

BandFactors Timoshenko::factors(double m, double k) const {
  const MatrixXd matrix = element(m, k);
  MatrixXd rows = MatrixXd::Zero(matrix.rows(), size());
  for (Index e = 0; e < n_; ++e) {
    const Index first = 2 * (e * p_ - 1);
    for (Index i = std::max<Index>(0, -first); i < matrix.rows(); ++i) {
      for (Index j = std::max<Index>(0, -first); j <= i; ++j) rows(i - j, first + i) += matrix(i, j);
    }
  }
  return BandFactors(std::move(rows));
}

VectorXd Timoshenko::mass_solve(const Vector& f) const {
  VectorXd x = f;
  mass_factors_.solve_in_place(x);
  return x;
}

VectorXd Timoshenko::flexibility_times(const Vector& f) const {
  VectorXd q(size());
  with_element([&](const auto& element) {
    using Vector2 = Eigen::Vector2d;
    Vector2 beyond(0.0, 0.0);  // moment/r and shear force at an element's right end
    for (Index e = n_ - 1; e >= 0; --e) {
      typename std::decay_t<decltype(element)>::Own own = f.segment(2 * p_ * e, 2 * p_);
      own.template tail<2>() += beyond;
      beyond = own.template tail<2>();
      beyond[0] += h_ / r_ * beyond[1];
      // By the strains: what rounding leaves in them is as small as they are, however stiff they are.
      own = element.from_strains.transpose().lazyProduct(own).cwiseQuotient(element.weights).eval();
      q.segment(2 * p_ * e, 2 * p_) = element.from_strains.lazyProduct(own);
    }
    Vector2 left(0.0, 0.0);  // θ̃ and u
    for (Index e = 0; e < n_; ++e) {
      auto right = q.segment<2>(2 * p_ * (e + 1) - 2);
      left[1] += h_ / r_ * left[0];
      right += left;
      left = right;
    }
  });
  return q;
}

VectorXd Timoshenko::weighted_strains(const Vector& q) const {
  VectorXd strains(size());
  with_element([&](const auto& element) {
    const auto h_kappa = element.weight.h_kappa.cwiseSqrt().eval(), h_gamma = element.weight.h_gamma.cwiseSqrt().eval();
    for (Index e = 0; e < n_; ++e) {
      const auto s = element.strains(element.of(q.data(), e));
      strains.segment(2 * p_ * e, p_) = h_kappa.cwiseProduct(s.h_kappa);
      strains.segment((2 * e + 1) * p_, p_) = h_gamma.cwiseProduct(s.h_gamma);
    }
  });
  return strains;
}

double Timoshenko::mass_norm2(const Vector& q) const { return q.dot(mass_times(q)); }

VectorXd Timoshenko::linear_shape() const {
  VectorXd q = VectorXd::Zero(size());
  for (Index e = 1; e <= n_; ++e) q[2 * p_ * e - 1] = static_cast<double>(e) * h_;
  return q;
}

const VectorXd& Timoshenko::load(std::size_t shape) const {
  VectorXd& F = loads_[shape];
  if (F.size() != 0) return F;
  F = VectorXd::Zero(size());
  const Element<Dynamic> element(*this);
  if (Loads::is_point(shape)) {
    const double place = point_force_place(parameters_, shape) * static_cast<double>(n_);
    const Index at = std::min(static_cast<Index>(place), n_ - 1);
    const VectorXd values = basis(place - static_cast<double>(at));
    element.assemble(F,
                     [&](Index e) { return Element<Dynamic>::Fields{0.0 * values, (e == at ? 1.0 : 0.0) * values}; });
    return F;
  }
  at_gauss_points([&](double part, double weight) {
    const VectorXd values = basis(part);
    element.assemble(F, [&](Index e) {
      const double place = (static_cast<double>(e) + part) / static_cast<double>(n_);
      return Element<Dynamic>::Fields{0.0 * values, h_ * weight * load_density(parameters_, shape, place) * values};
    });
  });
  return F;
}

InternalForces Timoshenko::inertia(const Vector& a) const {
  InternalForces forces;
  const double mu = parameters_.density * parameters_.area;
  const Element<Dynamic> element(*this);
  constexpr Index intervals = shape_points - 1;
  double shear = 0.0, moment = 0.0;  // at the element's right end
  for (Index e = n_ - 1, j = intervals; e >= 0; --e) {
    const auto [theta, u] = element.of(a.data(), e);
    for (; j >= 0 && j * n_ >= e * intervals; --j) {
      const double from = static_cast<double>(j * n_ - e * intervals) / static_cast<double>(intervals);
      const double length = (1.0 - from) * h_;
      forces.shear[j] = shear;
      forces.moment[j] = moment + length * shear;
      at_gauss_points([&](double part, double weight) {
        const VectorXd values = mu * length * weight * basis(from + part * (1.0 - from));
        forces.shear[j] += values.dot(u);
        forces.moment[j] += part * length * values.dot(u) + r_ * values.dot(theta);
      });
    }
    const double mean = T_.row(0).dot(u);  // of u; the integral of P_1 with the lever is 1/6
    moment += h_ * shear + mu * h_ * (h_ * (0.5 * mean + T_.row(1).dot(u) / 6.0) + r_ * T_.row(0).dot(theta));
    shear += mu * h_ * mean;
  }
  return forces;
}

// T turns them into those by Legendre polynomials, found from ξ P_j = ((j+1) P_{j+1} + j P_{j−1})/(2j+1).
VectorXd Timoshenko::basis(double part) const {
  const double xi = 2.0 * part - 1.0;
  VectorXd P(p_ + 1);
  P[0] = 1.0;
  P[1] = xi;
  for (Index k = 2; k <= p_; ++k) {
    const double degree = static_cast<double>(k);
    P[k] = ((2.0 * degree - 1.0) * xi * P[k - 1] - (degree - 1.0) * P[k - 2]) / degree;
  }
  return T_.transpose() * P;
}

Shape Timoshenko::sample(const Vector& q, int field) const {
  Shape values;
  const Element<Dynamic> element(*this);
  constexpr Index intervals = shape_points - 1;
  for (Index j = 0; j <= intervals; ++j) {
    const Index e = std::min(j * n_ / intervals, n_ - 1);  // its left node is at x_j or left of it
    const double part = static_cast<double>(j * n_ - e * intervals) / static_cast<double>(intervals);
    const VectorXd unknowns = element.field(q.data() + field, e);
    values[j] = part == 0.0 ? unknowns[0] : unknowns.dot(basis(part));
  }
  return values;
}

}  // namespace beam
