#include "generalized_alpha.hpp"

#include <Eigen/SparseCholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "step_cache.hpp"
#include "timoshenko.hpp"

namespace beam {
namespace {

using Eigen::Index;
using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::VectorXd;

// Banded matrices stay banded in their natural order.
using Factorisation = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::NaturalOrdering<int>>;

/// LDLᵀ of a matrix of linear elements, eliminated node by node from both ends to a node in the middle ("burn at both
/// ends": Dongarra, Bunch, Moler & Stewart, LINPACK Users' Guide, SIAM, 1979, chapter 7; twisted factorisation:
/// Meurant, SIAM J. Matrix Anal. Appl. 13, 1992, 707–728). In a sweep each unknown waits for the one before; the two
/// halves do not wait for each other.
class TwistedFactors {
 public:
  /// False if a pivot is not positive.
  bool factorise(const Eigen::SparseMatrix<double>& S) {
    nodes_.resize(static_cast<std::size_t>(S.rows() / 2));
    middle_ = S.rows() / 4;
    const auto block = [&S](Index row, Index column) { return Matrix2d(S.block(2 * row, 2 * column, 2, 2)); };
    bool positive = true;
    const auto factorise_pivot = [&](Index i, const Matrix2d& pivot) {  // of which the lower triangle is stored
      Node& f = node(i);
      f.within = pivot(1, 0) / pivot(0, 0);
      const double second = pivot(1, 1) - f.within * pivot(1, 0);
      positive = positive && pivot(0, 0) > 0.0 && second > 0.0;
      f.inverse = {1.0 / pivot(0, 0), 1.0 / second};
    };
    const auto eliminate = [&](Index i, Index next, const Matrix2d& carried) -> Matrix2d {
      factorise_pivot(i, block(i, i) - carried);
      Node& f = node(i);
      Matrix2d coupling = next > i ? block(next, i) : Matrix2d(block(i, next).transpose());
      coupling.col(1) -= f.within * coupling.col(0);
      f.next = coupling * f.inverse.asDiagonal();
      return f.next * coupling.transpose();
    };
    Matrix2d left = Matrix2d::Zero(), right = left;
    for (Index i = 0; i < middle_; ++i) left = eliminate(i, i + 1, left);
    for (Index i = S.rows() / 2 - 1; i > middle_; --i) right = eliminate(i, i - 1, right);
    factorise_pivot(middle_, block(middle_, middle_) - left - right);
    return positive;
  }

  /// x = (LDLᵀ)⁻¹ b
  void solve(const VectorXd& b, VectorXd& x) const {
    x.resize(b.size());
    const Index last = b.size() / 2 - 1;
    Values left = {b[0], b[1]}, right = {b[2 * last], b[2 * last + 1]};
    for (Index i = 0, j = last; i < middle_; ++i, --j) {
      left = eliminate(i, left, b, i + 1, x);
      if (j > middle_) right = eliminate(j, right, b, j - 1, x);  // one less where the number of nodes is even
    }
    const Node& f = node(middle_);
    double &x0 = x[2 * middle_], &x1 = x[2 * middle_ + 1];
    const double y0 = left[0] + right[0] - b[2 * middle_];
    x1 = f.inverse[1] * (left[1] + right[1] - b[2 * middle_ + 1] - f.within * y0);
    x0 = f.inverse[0] * y0 - f.within * x1;
    left = right = {x0, x1};
    for (Index i = middle_ - 1, j = middle_ + 1; i >= 0; --i, ++j) {
      left = substitute(i, left, x);
      if (j <= last) right = substitute(j, right, x);
    }
  }

 private:
  struct Node {
    double within;     // L in the rows of the node
    Vector2d inverse;  // of D
    Matrix2d next;     // L in the rows of the next node towards the middle
  };
  using Values = std::array<double, 2>;  // at a node

  // y: right-hand side of node i less what was eliminated before; returns that of the next. Inlined, so that it stays
  // in registers; what is waited for comes last in each sum.
  EIGEN_ALWAYS_INLINE Values eliminate(Index i, const Values& y, const VectorXd& b, Index next, VectorXd& x) const {
    const Node& f = node(i);
    const double y0 = y[0], y1 = y[1] - f.within * y0;
    x[2 * i] = f.inverse[0] * y0;
    x[2 * i + 1] = f.inverse[1] * y1;
    return {b[2 * next] - f.next(0, 0) * y0 - f.next(0, 1) * y1,
            b[2 * next + 1] - f.next(1, 0) * y0 - f.next(1, 1) * y1};
  }

  // z: the solution at the next node towards the middle; returns that at node i.
  EIGEN_ALWAYS_INLINE Values substitute(Index i, const Values& z, VectorXd& x) const {
    const Node& f = node(i);
    double &x0 = x[2 * i], &x1 = x[2 * i + 1];
    x1 = x1 - f.next(1, 1) * z[1] - f.next(0, 1) * z[0];
    x0 = x0 - f.next(1, 0) * z[1] - f.next(0, 0) * z[0] - f.within * x1;
    return {x0, x1};
  }

  Node& node(Index i) { return nodes_[static_cast<std::size_t>(i)]; }
  const Node& node(Index i) const { return nodes_[static_cast<std::size_t>(i)]; }

  std::vector<Node> nodes_;
  Index middle_ = 0;
};

/// S = mass M + stiffness K of one step size, factorised.
struct StepMatrix {
  double mass = 0.0, stiffness = 0.0;
  Eigen::SparseMatrix<double> matrix;
  Factorisation factorisation;
  TwistedFactors twisted;  // instead, of linear elements
};

/// The midpoint rule's w without tip force. It is linear in that force: a coupling that repeats a step from one state
/// with other forces solves once.
struct FreeStep {
  double size = 0.0;  // 0: none
  Loads::Values loads{};
  VectorXd q, v, w;

  bool holds(double h, const Loads::Values& mean_loads, const VectorXd& q_now, const VectorXd& v_now) const {
    return h == size && mean_loads == loads && q_now == q && v_now == v;
  }
};

class GeneralizedAlphaBeam final : public Beam {
 public:
  GeneralizedAlphaBeam(const Parameters& p, const Timoshenko& mesh)
      : Beam(static_cast<std::size_t>(p.rho_inf == 1.0 ? 2 * mesh.size() : 3 * mesh.size() + remembered)),
        mesh_(mesh),
        mu_(mesh_.mass_per_length()),
        alpha_(p.alpha_b),
        midpoint_(p.rho_inf == 1.0),
        linear_(p.element_degree == 1),
        alpha_m_((2.0 * p.rho_inf - 1.0) / (p.rho_inf + 1.0)),
        alpha_f_(p.rho_inf / (p.rho_inf + 1.0)),
        beta_(0.25 * (1.0 - alpha_m_ + alpha_f_) * (1.0 - alpha_m_ + alpha_f_)),
        gamma_(0.5 - alpha_m_ + alpha_f_),
        K_(mesh_.stiffness()),
        M_(mesh_.mass()),
        mass_factor_(M_),
        resultants_(mesh_),
        tip_response_(mass_factor_.solve(mesh_.unit_tip_force()) / mu_),
        q_(p.initial_deflection_slope * mesh_.linear_shape()),
        v_(p.initial_velocity_slope * mesh_.linear_shape()),
        a_(VectorXd::Zero(midpoint_ ? 0 : mesh_.size())),
        q0_(mesh_.size()),
        v0_(mesh_.size()),
        a0_(a_),
        rhs_(mesh_.size()) {
    require_factor(mass_factor_);
    const auto largest = [](const auto& values) { return values.cwiseAbs().maxCoeff(); };
    ordinary_ = true;
    for (const double value : {largest(K_.coeffs()), largest(shape(Loads::distributed)), largest(tip_response_), mu_,
                               1.0 / mu_, alpha_, 1.0 / mesh_.radius_of_gyration()}) {
      ordinary_ = ordinary_ && value < ordinary;
    }
  }

  double tip_displacement() const override { return q_[mesh_.tip_index()]; }
  double tip_velocity() const override { return v_[mesh_.tip_index()]; }
  Response response(Order order, const Loads::Values& loads_rate, double tip_force_rate) const override {
    const VectorXd now = mass_factor_.solve(inertia()) / mu_;
    if (order == Order::value) return respond(now, now_.loads, now_.tip_force);
    VectorXd force = load_of(loads_rate) - mu_ * mesh_.stiffness_times(VectorXd(v_ + alpha_ * now));
    force[mesh_.tip_index()] += tip_force_rate;
    return respond(mass_factor_.solve(force) / mu_, loads_rate, tip_force_rate);
  }
  void rest() override {
    VectorXd force = load_of(now_.loads);
    force[mesh_.tip_index()] += now_.tip_force;
    q_ = mesh_.flexibility_times(force) / mu_;
    v_.setZero();
    a_.setZero();
    last_ = {now_.tip_force, 0.0, 1.0, now_.loads};
  }
  double tip_rotation() const override { return q_[mesh_.tip_rotation_index()] / mesh_.radius_of_gyration(); }
  double tip_rotation_rate() const override { return v_[mesh_.tip_rotation_index()] / mesh_.radius_of_gyration(); }
  double kinetic_power() const override { return v_.dot(inertia()); }
  double strain_power() const override { return mu_ * v_.dot(mesh_.stiffness_times(q_)); }
  double dissipated_power() const override { return mu_ * alpha_ * mesh_.stiffness_norm2(v_); }
  double load_power_per_unit(std::size_t i) const override { return shape(i).dot(v_); }
  double kinetic_energy() const override { return 0.5 * mu_ * mesh_.mass_norm2(v_); }
  double strain_energy() const override { return 0.5 * mu_ * mesh_.stiffness_norm2(q_); }
  double load_work_per_unit(std::size_t i) const override { return shape(i).dot(q_); }
  double tip_mass() const override { return 1.0 / tip_response_[mesh_.tip_index()]; }
  void deflection(Shape& u) const override { mesh_.sample_deflection(q_.data(), u.data()); }
  void rotation(Shape& theta) const override {
    mesh_.sample_scaled_rotation(q_.data(), theta.data());
    for (double& value : theta) value /= mesh_.radius_of_gyration();
  }

 private:
  double advance(double h, const Polynomial& c, const Loads& loads) override {
    const StepMatrix& S = cache_.get(h, [this](double size, StepMatrix& matrix) { factorise(size, matrix); });
    q0_.swap(q_);
    v0_.swap(v_);
    a0_.swap(a_);
    if (!midpoint_) before_ = last_;
    Loads::Values seen{};  // by the scheme
    loads.for_each(
        [&](std::size_t i, const Polynomial& f) { seen[i] = midpoint_ ? mean(f, h) : value(f, (1.0 - alpha_f_) * h); });
    now_.dissipated += midpoint_ ? midpoint_step(S, h, mean(c, h), seen) : alpha_step(S, h, c, loads, seen);
    loads.for_each([&](std::size_t i, const Polynomial&) { now_.load_work += seen[i] * shape(i).dot(q_ - q0_); });
    const double u0 = q0_[mesh_.tip_index()], u1 = q_[mesh_.tip_index()];
    now_.integral = 0.5 * h * (u0 + u1);
    now_.integral_2 = h * h * (2.0 * u0 + u1) / 6.0;
    return q_.squaredNorm() + v_.squaredNorm() + a_.squaredNorm();
  }

  void undo() override {
    q_.swap(q0_);
    v_.swap(v0_);
    a_.swap(a0_);
    last_ = before_;
  }

  void strike(double impulse) override {
    v_ += impulse * tip_response_;
    last_.impulse += impulse;
  }

  void save_motion(double* numbers) const override {
    for (const VectorXd* x : {&q_, &v_, &a_}) numbers = std::copy_n(x->data(), x->size(), numbers);
    if (!midpoint_) std::memcpy(numbers, &last_, sizeof last_);
  }

  void restore_motion(const double* numbers) override {
    for (VectorXd* x : {&q_, &v_, &a_}) {
      *x = Eigen::Map<const VectorXd>(numbers, x->size());
      numbers += x->size();
    }
    if (!midpoint_) std::memcpy(&last_, numbers, sizeof last_);
  }

  /// ρA M q̈ under what acts now: all forces that the stiffness and the damping leave.
  VectorXd inertia() const {
    VectorXd force = load_of(now_.loads) - mu_ * mesh_.stiffness_times(VectorXd(q_ + alpha_ * v_));
    force[mesh_.tip_index()] += now_.tip_force;
    return force;
  }

  Response respond(const VectorXd& acceleration, const Loads::Values& loads, double tip_force) const {
    Response response{acceleration[mesh_.tip_index()], resultants_.of(loads, tip_force)};
    const InternalForces inertia = mesh_.inertia(acceleration.data());
    for (std::size_t j = 0; j < inertia.shear.size(); ++j) {
      response.forces.shear[j] -= inertia.shear[j];
      response.forces.moment[j] -= inertia.moment[j];
    }
    return response;
  }

  /// Makes q_ and v_ from q0_ and v0_; returns the loss.
  double midpoint_step(const StepMatrix& S, double h, double force, const Loads::Values& loads) {
    const VectorXd &q = q0_, &v = v0_;
    if (!free_.holds(h, loads, q, v)) {
      free_.size = 0.0;
      rhs_ = (0.5 * h / mu_) * load_of(loads);
      mesh_.add_mass_times(1.0, v.data(), rhs_.data());
      mesh_.add_stiffness_times(-0.5 * h, q.data(), rhs_.data());
      solve(S, free_.w);
      free_.q = q;
      free_.v = v;
      free_.loads = loads;
      free_.size = h;
    }
    if (response_size_ != h) {
      rhs_.setZero();
      rhs_[mesh_.tip_index()] = 0.5 * h / mu_;
      solve(S, response_);
      response_size_ = h;
    }
    w_ = free_.w + force * response_;
    q_ = q + h * w_;
    v_ = 2.0 * w_ - v;
    return alpha_ > 0.0 ? mu_ * h * alpha_ * mesh_.stiffness_norm2(w_) : 0.0;
  }

  /// Makes q_, v_ and a_ from q0_, v0_ and a0_; returns the loss.
  double alpha_step(const StepMatrix& S, double h, const Polynomial& c, const Loads& loads, const Loads::Values& seen) {
    const VectorXd &q = q0_, &v = v0_;
    VectorXd a = a0_;
    if (add_missing_force(c[0], loads.at(0.0))) {
      solve(S, w_);
      a += (1.0 - alpha_m_) * w_;
    }
    const double f = 1.0 - alpha_f_;
    rhs_ = load_of(seen) / mu_;
    rhs_[mesh_.tip_index()] += value(c, f * h) / mu_;
    w_ = alpha_ * (v + (f * (1.0 - gamma_) * h) * a) + q + (f * h) * (v + ((0.5 - beta_) * h) * a);
    mesh_.add_mass_times(-alpha_m_, a.data(), rhs_.data());
    mesh_.add_stiffness_times(-1.0, w_.data(), rhs_.data());
    solve(S, a_);
    q_ = q + h * (v + h * ((0.5 - beta_) * a + beta_ * a_));
    v_ = v + h * ((1.0 - gamma_) * a + gamma_ * a_);
    last_ = {value(c, h), 0.0, 1.0, loads.at(h)};
    if (alpha_ == 0.0) return 0.0;
    w_ = f * v_ + alpha_f_ * v;
    return mu_ * alpha_ * (q_ - q).dot(mesh_.stiffness_times(w_));
  }

  /// rhs_ = the force that the acceleration at the step's start does not know of yet; false if there is none.
  bool add_missing_force(double tip_force, Loads::Values loads) {
    if (last_.started == 0.0) {
      rhs_ = load_of(loads) / mu_ - mesh_.stiffness_times(VectorXd(q0_ + alpha_ * v0_));
      rhs_[mesh_.tip_index()] += tip_force / mu_;
      return true;
    }
    for (std::size_t i = 0; i < loads.size(); ++i) loads[i] = (loads[i] - last_.loads[i]) / mu_;
    tip_force -= last_.tip_force;
    if (loads == Loads::Values{} && tip_force == 0.0 && last_.impulse == 0.0) return false;
    rhs_ = load_of(loads);
    rhs_[mesh_.tip_index()] += tip_force / mu_;
    if (last_.impulse != 0.0) rhs_ -= (alpha_ * last_.impulse) * mesh_.stiffness_times(tip_response_);
    return true;
  }

  const VectorXd& shape(std::size_t i) const {
    if (shapes_[i].size() == 0) shapes_[i] = mesh_.load(i);
    return shapes_[i];
  }

  /// Σ values·F; valid until the next call.
  const VectorXd& load_of(const Loads::Values& values) const {
    load_.setZero(mesh_.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (values[i] != 0.0) load_ += values[i] * shape(i);
    }
    return load_;
  }

  void solve_once(const StepMatrix& S, VectorXd& x) {
    if (linear_) {
      S.twisted.solve(rhs_, x);
    } else {
      x = S.factorisation.solve(rhs_);
    }
  }

  /// x = S⁻¹ rhs_ with one step of iterative refinement.
  void solve(const StepMatrix& S, VectorXd& x) {
    solve_once(S, x);
    mesh_.add_mass_times(-S.mass, x.data(), rhs_.data());
    mesh_.add_stiffness_times(-S.stiffness, x.data(), rhs_.data());
    solve_once(S, correction_);
    x += correction_;
  }

  void factorise(double h, StepMatrix& S) const {
    const double f = 1.0 - alpha_f_;
    S.mass = midpoint_ ? 1.0 : 1.0 - alpha_m_;
    S.stiffness = midpoint_ ? 0.25 * h * h + 0.5 * alpha_ * h : f * (alpha_ * gamma_ * h + beta_ * h * h);
    if (S.matrix.size() == 0) {
      S.matrix = K_;
      if (!linear_) S.factorisation.analyzePattern(K_);
    }
    S.matrix.coeffs() = S.mass * M_.coeffs() + S.stiffness * K_.coeffs();
    bool factorised = false;
    if (linear_) {
      factorised = S.twisted.factorise(S.matrix);
    } else {
      S.factorisation.factorize(S.matrix);
      factorised = S.factorisation.info() == Eigen::Success;
    }
    if (!factorised) {
      throw std::domain_error("beam: the matrix of the time step cannot be factorised; use a smaller step size");
    }
  }

  Timoshenko mesh_;
  double mu_;     // ρA [kg/m]: matrices and what is solved for them are per ρA
  double alpha_;  // α_b [s]
  bool midpoint_, linear_;
  double alpha_m_, alpha_f_, beta_, gamma_;
  Eigen::SparseMatrix<double> K_, M_;                  // with the same pattern
  mutable std::array<VectorXd, Loads::count> shapes_;  // of the loads, where one was asked for
  mutable VectorXd load_;
  Timoshenko::MassFactor mass_factor_;
  LoadResultants resultants_;
  VectorXd tip_response_;  // M⁻¹e/ρA [1/kg], the velocity that a unit impulse leaves

  VectorXd q_, v_, a_;  // state [m, m/s, m/s²]; a only for ρ∞ < 1
  struct Last {         // for ρ∞ < 1
    double tip_force;   // at the end of the last step, as the loads: what a_ knows of
    double impulse;     // since then [N·s]
    double started;     // 0 before the first step, when a_ knows of nothing
    Loads::Values loads;
  };
  static constexpr Index remembered = sizeof(Last) / sizeof(double);
  Last last_{}, before_{};

  FreeStep free_;
  VectorXd response_;  // w of a unit tip force, for steps of response_size_
  double response_size_ = 0.0;
  VectorXd q0_, v0_, a0_;          // those of the last step's start
  VectorXd rhs_, w_, correction_;  // work space
  StepCache<StepMatrix> cache_;
};

}  // namespace

std::unique_ptr<Beam> make_generalized_alpha_beam(const Parameters& parameters) {
  return std::make_unique<GeneralizedAlphaBeam>(parameters, Timoshenko(parameters));
}

}  // namespace beam
