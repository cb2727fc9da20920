#include "generalized_alpha.hpp"

#include <Eigen/SparseCholesky>

#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

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
  double size = 0.0, distributed_load = 0.0;  // size 0: none
  VectorXd q, v, w;

  bool holds(double h, double load, const VectorXd& q_now, const VectorXd& v_now) const {
    return h == size && load == distributed_load && q_now == q && v_now == v;
  }
};

class GeneralizedAlphaBeam final : public BeamIntegrator {
 public:
  explicit GeneralizedAlphaBeam(const Parameters& p)
      : mesh_(p),
        mu_(p.density * p.area),
        alpha_(p.alpha_b),
        midpoint_(p.rho_inf == 1.0),
        linear_(p.element_degree == 1),
        alpha_m_((2.0 * p.rho_inf - 1.0) / (p.rho_inf + 1.0)),
        alpha_f_(p.rho_inf / (p.rho_inf + 1.0)),
        beta_(0.25 * (1.0 - alpha_m_ + alpha_f_) * (1.0 - alpha_m_ + alpha_f_)),
        gamma_(0.5 - alpha_m_ + alpha_f_),
        K_(mesh_.stiffness()),
        M_(mesh_.mass()),
        uniform_load_(mesh_.uniform_load() / mu_),
        hat_load_(p.tip_load_coefficient / mu_ * mesh_.hat_load()),
        tip_response_(mesh_.mass_solve(mesh_.unit_tip_force()) / mu_),
        compliance_(mesh_.flexibility_times(mesh_.unit_tip_force())[mesh_.tip_index()] / mu_),
        q_(p.initial_deflection_slope * mesh_.linear_shape()),
        v_(p.initial_velocity_slope * mesh_.linear_shape()),
        a_(VectorXd::Zero(midpoint_ ? 0 : mesh_.size())),
        rhs_(mesh_.size()),
        w_(mesh_.size()),
        work_(mesh_.size()),
        work2_(mesh_.size()) {
    const auto largest = [](const auto& values) { return values.cwiseAbs().maxCoeff(); };
    ordinary_ = true;
    for (const double value : {largest(K_.coeffs()), largest(uniform_load_), largest(hat_load_), largest(tip_response_),
                               mu_, 1.0 / mu_, alpha_, 1.0 / mesh_.radius_of_gyration()}) {
      ordinary_ = ordinary_ && value < ordinary;
    }
    find_load();
  }

  void step(double size, const TipForce& c, double distributed_load) override {
    const StepMatrix& S = cache_.get(size, [this](double h, StepMatrix& matrix) { factorise(h, matrix); });
    if (midpoint_) {
      midpoint_step(S, size, c, distributed_load);
    } else {
      alpha_step(S, size, c, distributed_load);
    }
  }

  void apply_tip_impulse(double impulse) override {
    w_ = v_ + impulse * tip_response_;
    if (!w_.allFinite()) throw_not_finite(0.0, {impulse, 0.0, 0.0}, now_.distributed_load);
    v_.swap(w_);
    if (!midpoint_) now_.pending_impulse += impulse;
  }

  void set_distributed_load(double distributed_load) override {
    if (distributed_load == now_.distributed_load) return;
    if (!midpoint_ && now_.started) now_.pending_load += distributed_load - now_.distributed_load;
    now_.distributed_load = distributed_load;
    find_load();
  }

  double tip_displacement() const override { return q_[mesh_.tip_index()]; }
  double tip_velocity() const override { return v_[mesh_.tip_index()]; }
  double tip_acceleration() const override { return mu_ * tip_response_.dot(residual_force()); }
  double tip_rotation() const override { return q_[mesh_.tip_rotation_index()] / mesh_.radius_of_gyration(); }
  double tip_displacement_integral() const override { return now_.integral; }
  double tip_displacement_integral_2() const override { return now_.integral_2; }
  double kinetic_energy() const override { return 0.5 * mu_ * mesh_.mass_norm2(v_); }
  double strain_energy() const override { return 0.5 * mu_ * mesh_.stiffness_norm2(q_); }
  double dissipated_energy() const override { return now_.dissipated; }
  double load_potential() const override { return -mu_ * load_.dot(q_); }
  double tip_mass() const override { return 1.0 / tip_response_[mesh_.tip_index()]; }
  double static_tip_compliance() const override { return compliance_; }
  void deflection(std::array<double, shape_points>& u) const override { mesh_.sample_deflection(q_.data(), u.data()); }
  void rotation(std::array<double, shape_points>& theta) const override {
    mesh_.sample_scaled_rotation(q_.data(), theta.data());
    for (double& value : theta) value /= mesh_.radius_of_gyration();
  }
  std::vector<double> frequencies() const override { return {}; }

  void save(std::vector<double>& state) const override {
    state.clear();
    state.reserve(static_cast<std::size_t>(q_.size() + v_.size() + a_.size()) + 8);
    for (const VectorXd* x : {&q_, &v_, &a_}) state.insert(state.end(), x->data(), x->data() + x->size());
    for (const double value : {now_.integral, now_.integral_2, now_.dissipated, now_.end_force, now_.distributed_load,
                               now_.pending_impulse, now_.pending_load, now_.started ? 1.0 : 0.0}) {
      state.push_back(value);
    }
  }

  void restore(const std::vector<double>& state) override {
    const double* from = state.data();
    for (VectorXd* x : {&q_, &v_, &a_}) {
      *x = Eigen::Map<const VectorXd>(from, x->size());
      from += x->size();
    }
    const double distributed_load = from[4];
    set_distributed_load(distributed_load);
    now_.integral = from[0];
    now_.integral_2 = from[1];
    now_.dissipated = from[2];
    now_.end_force = from[3];
    now_.pending_impulse = from[5];
    now_.pending_load = from[6];
    now_.started = from[7] != 0.0;
  }

 private:
  void midpoint_step(const StepMatrix& S, double h, const TipForce& c, double distributed_load) {
    if (!free_.holds(h, distributed_load, q_, v_)) {
      start_with_load(0.5 * h, 0.0, distributed_load);
      mesh_.add_products(1.0, v_, -0.5 * h, q_, rhs_);
      free_.size = 0.0;
      solve(S, free_.w);
      free_.q = q_;
      free_.v = v_;
      free_.distributed_load = distributed_load;
      free_.size = h;
    }
    if (response_size_ != h) {
      rhs_.setZero();
      rhs_[mesh_.tip_index()] = 0.5 * h / mu_;
      solve(S, response_);
      response_size_ = h;
    }
    w_ = free_.w + mean_force(c, h) * response_;

    work_ = q_ + h * w_;
    work2_ = 2.0 * w_ - v_;
    const double loss = alpha_ > 0.0 ? mu_ * h * alpha_ * mesh_.stiffness_norm2(w_) : 0.0;
    finish(h, c, distributed_load, loss, nullptr);
  }

  void alpha_step(const StepMatrix& S, double h, const TipForce& c, double distributed_load) {
    VectorXd a = a_;
    if (add_missing_force(c[0], distributed_load)) {
      solve(S, w_);
      a += (1.0 - alpha_m_) * w_;
    }
    const double f = 1.0 - alpha_f_;
    start_with_load(1.0, force_at(c, f * h), distributed_load);
    work2_ = alpha_ * (v_ + (f * (1.0 - gamma_) * h) * a) + q_ + (f * h) * (v_ + ((0.5 - beta_) * h) * a);
    mesh_.add_products(-alpha_m_, a, -1.0, work2_, rhs_);
    VectorXd a1(mesh_.size());
    solve(S, a1);

    work_ = q_ + h * (v_ + h * ((0.5 - beta_) * a + beta_ * a1));
    work2_ = v_ + h * ((1.0 - gamma_) * a + gamma_ * a1);
    double loss = 0.0;
    if (alpha_ > 0.0) {
      w_ = f * work2_ + alpha_f_ * v_;
      mesh_.stiffness_times(w_.data(), rhs_.data());
      loss = mu_ * alpha_ * (work_ - q_).dot(rhs_);
    }
    finish(h, c, distributed_load, loss, &a1);
  }

  /// rhs_ = the force that a_ does not know of yet; false if there is none.
  bool add_missing_force(double tip_force, double distributed_load) {
    if (!now_.started) {
      rhs_ = hat_load_ - mesh_.stiffness_times(VectorXd(q_ + alpha_ * v_));
      rhs_ += distributed_load * uniform_load_;
      rhs_[mesh_.tip_index()] += tip_force / mu_;
      return true;
    }
    const double load = distributed_load - now_.distributed_load + now_.pending_load,
                 force = tip_force - now_.end_force;
    if (load == 0.0 && force == 0.0 && now_.pending_impulse == 0.0) return false;
    rhs_ = load * uniform_load_;
    rhs_[mesh_.tip_index()] += force / mu_;
    if (now_.pending_impulse != 0.0) rhs_ -= (alpha_ * now_.pending_impulse) * mesh_.stiffness_times(tip_response_);
    return true;
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
    mesh_.add_products(-S.mass, x, -S.stiffness, x, rhs_);
    solve_once(S, work_);
    x += work_;
  }

  // Accepts work_ and work2_ as the new q and v, or throws.
  void finish(double h, const TipForce& c, double distributed_load, double loss, VectorXd* a1) {
    const double u0 = q_[mesh_.tip_index()], u1 = work_[mesh_.tip_index()];
    const Scalars before = now_;
    q_.swap(work_);
    v_.swap(work2_);
    if (a1 != nullptr) a_.swap(*a1);
    now_.integral = 0.5 * h * (u0 + u1);
    now_.integral_2 = h * h * (2.0 * u0 + u1) / 6.0;
    now_.dissipated += loss;
    now_.end_force = force_at(c, h);
    if (distributed_load != before.distributed_load) set_distributed_load(distributed_load);
    now_.pending_impulse = 0.0;
    now_.pending_load = 0.0;
    now_.started = true;
    const bool harmless = ordinary_ && q_.squaredNorm() < ordinary && v_.squaredNorm() < ordinary &&
                          ordinary_inputs(h, c, distributed_load);
    if (!harmless && !(outputs_finite(*this) && a_.allFinite())) {
      q_.swap(work_);
      v_.swap(work2_);
      if (a1 != nullptr) a_.swap(*a1);
      set_distributed_load(before.distributed_load);
      now_ = before;
      throw_not_finite(h, c, distributed_load);
    }
  }

  void find_load() { load_ = now_.distributed_load * uniform_load_ + hat_load_; }

  void start_with_load(double factor, double tip_force, double distributed_load) {
    rhs_ = (factor * distributed_load) * uniform_load_ + factor * hat_load_;
    rhs_[mesh_.tip_index()] += factor * tip_force / mu_;
  }

  /// (F − K q − α_b K v)/ρA under the loads of the last step's end.
  VectorXd residual_force() const {
    VectorXd force = load_ - mesh_.stiffness_times(VectorXd(q_ + alpha_ * v_));
    force[mesh_.tip_index()] += now_.end_force / mu_;
    return force;
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
  double mu_;     // ρA [kg/m]: all below is per ρA
  double alpha_;  // α_b [s]
  bool midpoint_, linear_;
  bool ordinary_;  // no coefficient is so large that an output could overflow, see integrator.hpp
  double alpha_m_, alpha_f_, beta_, gamma_;
  Eigen::SparseMatrix<double> K_, M_;  // with the same pattern
  VectorXd uniform_load_, hat_load_;
  VectorXd tip_response_;  // M⁻¹e/ρA [1/kg], the velocity that a unit impulse leaves
  double compliance_;

  VectorXd q_, v_, a_;  // state [m, m/s, m/s²]; a only for ρ∞ < 1
  VectorXd load_;
  struct Scalars {
    double distributed_load = 0.0, end_force = 0.0;
    double integral = 0.0, integral_2 = 0.0;
    double dissipated = 0.0;
    // What a_ does not know of yet, besides the jump of C [N·s, N/m]; all of it before the first step.
    double pending_impulse = 0.0, pending_load = 0.0;
    bool started = false;
  };
  Scalars now_;

  FreeStep free_;
  VectorXd response_;  // w of a unit tip force, for steps of response_size_
  double response_size_ = 0.0;
  VectorXd rhs_, w_, work_, work2_;  // work space
  StepCache<StepMatrix> cache_;
};

}  // namespace

std::unique_ptr<BeamIntegrator> make_generalized_alpha_beam(const Parameters& parameters) {
  return std::make_unique<GeneralizedAlphaBeam>(parameters);
}

}  // namespace beam
