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
using Eigen::VectorXd;

/// LDLᵀ of a banded matrix, whose solution takes half the time of a sparse one's.
class BandFactors {
 public:
  /// Of a lower triangle in which `width` entries are below each of the diagonal. False if a pivot is not positive.
  bool factorise(const Eigen::SparseMatrix<double>& S, Index width) {
    rows_.setZero(width + 1, S.rows());
    for (Index j = 0; j < S.cols(); ++j)
      for (Eigen::SparseMatrix<double>::InnerIterator entry(S, j); entry; ++entry)
        rows_(entry.row() - j, entry.row()) = entry.value();
    VectorXd scaled(width + 1);  // a row of L times D
    for (Index i = 0; i < S.rows(); ++i) {
      double pivot = rows_(0, i);
      const Index before = std::min(i, width);
      for (Index k = before; k > 0; --k) {
        scaled[k] = rows_(k, i);
        for (Index m = before; m > k; --m) scaled[k] -= rows_(m - k, i - k) * scaled[m];
        rows_(k, i) = scaled[k] * rows_(0, i - k);
        pivot -= scaled[k] * rows_(k, i);
      }
      if (!(pivot > 0.0)) return false;
      rows_(0, i) = 1.0 / pivot;
    }
    return true;
  }

  /// x becomes (LDLᵀ)⁻¹ x.
  void solve(VectorXd& x) const {
    // Of linear elements the width is known to the compiler.
    rows_.rows() == 4 ? sweep(std::integral_constant<Index, 3>(), x.data()) : sweep(rows_.rows() - 1, x.data());
  }

 private:
  template <typename Width>
  void sweep(Width width, double* x) const {
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

  Eigen::MatrixXd rows_;  // 1/D, then L, in the k-th row L(i, i − k)
};

/// S = mass M + stiffness K of one step size, factorised.
struct StepMatrix {
  double mass = 0.0, stiffness = 0.0;
  BandFactors factors;
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
    const auto most = [](const auto& values) { return values.cwiseAbs().maxCoeff(); };
    require_coefficients({most(K_.coeffs()), most(shape(Loads::distributed)), most(tip_response_), mu_, 1.0 / mu_,
                          alpha_, 1.0 / mesh_.radius_of_gyration()});
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

  /// x = S⁻¹ rhs_ with one step of iterative refinement.
  void solve(const StepMatrix& S, VectorXd& x) {
    x = rhs_;
    S.factors.solve(x);
    mesh_.add_mass_times(-S.mass, x.data(), rhs_.data());
    mesh_.add_stiffness_times(-S.stiffness, x.data(), rhs_.data());
    S.factors.solve(rhs_);
    x += rhs_;
  }

  void factorise(double h, StepMatrix& S) const {
    const double f = 1.0 - alpha_f_;
    S.mass = midpoint_ ? 1.0 : 1.0 - alpha_m_;
    S.stiffness = midpoint_ ? 0.25 * h * h + 0.5 * alpha_ * h : f * (alpha_ * gamma_ * h + beta_ * h * h);
    if (!S.factors.factorise(S.mass * M_ + S.stiffness * K_, mesh_.band_width())) {
      throw std::domain_error("beam: the matrix of the time step cannot be factorised; use a smaller step size");
    }
  }

  Timoshenko mesh_;
  double mu_;     // ρA [kg/m]: matrices and what is solved for them are per ρA
  double alpha_;  // α_b [s]
  bool midpoint_;
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
  VectorXd q0_, v0_, a0_;  // those of the last step's start
  VectorXd rhs_, w_;       // work space
  StepCache<StepMatrix> cache_;
};

}  // namespace

std::unique_ptr<Beam> make_generalized_alpha_beam(const Parameters& parameters) {
  return std::make_unique<GeneralizedAlphaBeam>(parameters, Timoshenko(parameters));
}

}  // namespace beam
