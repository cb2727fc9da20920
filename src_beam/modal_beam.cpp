#include "modal_beam.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <utility>

#include "modal_oscillator.hpp"
#include "modes.hpp"

namespace beam {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;

/// Structure of arrays over the modes; φ stands for φ(L).
struct Coefficients {
  ArrayXd sign, kick, drift, reflection;  // undamped; reflection = (1 − sign)/ω²
  ArrayXd one_minus_decay, G0, G1;        // damped; 1 − ġ = ω²G₁ + cG₀
  ArrayXd phi_G1, phi_G2, phi_G3;         // response of v, of v and η, of η to c₁ and c₂
  // ∫u and ∫∫u: from η₀ and v₀ per mode, from c₀, c₁, c₂, f_b and the hat load in sum.
  ArrayXd integral_eta, integral_v, integral2_eta, integral2_v;
  std::array<double, 5> integral_input, integral2_input;
};

/// c∫η̇² summed over the modes: from v₀², v₀r, r², and with c₁, c₂; from c₁², c₁c₂, c₂² in sum.
struct Dissipation {
  ArrayXd vv, vr, rr, v1, v2, r1, r2;
  std::array<double, 3> input;
};

class ModalBeam final : public BeamIntegrator {
 public:
  explicit ModalBeam(const Parameters& p)
      : modes_(compute_modes(Timoshenko(p), p)),
        tip_(modes_.tip),
        omega2_(modes_.omega.array().square()),
        damping_(p.alpha_b * omega2_),
        damped_(p.alpha_b > 0.0),
        hat_load_(p.tip_load_coefficient * modes_.hat_load.array()),
        hat_coefficient_(p.tip_load_coefficient),
        inverse_tip_mass_(tip_.square().sum()),
        compliance_((tip_ / modes_.omega.array()).square().sum()),
        eta_(p.initial_deflection_slope * modes_.linear_shape.array()),
        v_(p.initial_velocity_slope * modes_.linear_shape.array()),
        eta_next_(eta_.size()),
        v_next_(eta_.size()),
        force_(eta_.size()),
        r_(eta_.size()) {
    ordinary_ = modes_.omega.minCoeff() > 1.0 / ordinary;
    const auto bound = [this](double largest) { ordinary_ = ordinary_ && largest < ordinary; };
    for (const Eigen::VectorXd* values : {&modes_.tip, &modes_.tip_rotation, &modes_.uniform_load})
      bound(values->lpNorm<Eigen::Infinity>());
    bound(modes_.deflection.lpNorm<Eigen::Infinity>());
    bound(modes_.rotation.lpNorm<Eigen::Infinity>());
    bound(omega2_.maxCoeff());
    bound(damping_.maxCoeff());
    bound(hat_load_.abs().maxCoeff());
    set_distributed_load(0.0);
    update_tip();
  }

  void step(double size, const TipForce& c, double distributed_load) override {
    add_loss();
    const Coefficients& k =
        coefficients_.get(size, [this](double h, Coefficients& value) { make_coefficients(h, value); });
    const double previous_load = distributed_load_;
    if (distributed_load != previous_load) set_distributed_load(distributed_load);

    force_ = c[0] * tip_ + load_;
    r_ = force_ - omega2_ * eta_;
    if (damped_) {
      eta_next_ = eta_ + (k.G0 * v_ + k.G1 * r_ + c[1] * k.phi_G2 + c[2] * k.phi_G3);
      v_next_ = v_ + (k.G0 * r_ - k.one_minus_decay * v_ + c[1] * k.phi_G1 + c[2] * k.phi_G2);
    } else {
      v_next_ = v_ + k.kick * r_;
      eta_next_ = eta_ + k.drift * v_next_;
      v_next_ = k.sign * (v_next_ + k.kick * (force_ - omega2_ * eta_next_));
      eta_next_ = k.sign * eta_next_ + k.reflection * force_;
      if (c[1] != 0.0 || c[2] != 0.0) {
        eta_next_ += c[1] * k.phi_G2 + c[2] * k.phi_G3;
        v_next_ += c[1] * k.phi_G1 + c[2] * k.phi_G2;
      }
    }

    const std::array<double, 5> input = {c[0], c[1], c[2], distributed_load, hat_coefficient_};
    double integral = (k.integral_eta * eta_ + k.integral_v * v_).sum();
    double integral_2 = (k.integral2_eta * eta_ + k.integral2_v * v_).sum();
    for (std::size_t i = 0; i < input.size(); ++i) {
      integral += k.integral_input[i] * input[i];
      integral_2 += k.integral2_input[i] * input[i];
    }

    const Scalars before = now_;
    eta_.swap(eta_next_);
    v_.swap(v_next_);
    now_ = {(tip_ * eta_).sum(), (tip_ * v_).sum(), integral, integral_2, before.dissipated, force_at(c, size)};
    if (damped_) loss_step_ = {size, c[1], c[2]};
    const double energies = (v_.square() + omega2_ * eta_.square()).sum();
    const bool harmless = ordinary_ && energies < ordinary && ordinary_inputs(size, c, distributed_load);
    if (!harmless && !outputs_finite(*this)) {
      loss_step_.size = 0.0;
      eta_.swap(eta_next_);
      v_.swap(v_next_);
      now_ = before;
      set_distributed_load(previous_load);
      throw_not_finite(size, c, distributed_load);
    }
  }

  void apply_tip_impulse(double impulse) override {
    add_loss();
    v_next_ = v_ + impulse * tip_;
    const double velocity = (tip_ * v_next_).sum();
    if (!std::isfinite(velocity)) throw_not_finite(0.0, {impulse, 0.0, 0.0}, distributed_load_);
    v_.swap(v_next_);
    now_.velocity = velocity;
  }

  void set_distributed_load(double distributed_load) override {
    distributed_load_ = distributed_load;
    load_ = distributed_load * modes_.uniform_load.array() + hat_load_;
  }

  double tip_displacement() const override { return now_.displacement; }
  double tip_velocity() const override { return now_.velocity; }
  double tip_acceleration() const override {
    return (tip_ * (now_.end_force * tip_ + load_ - omega2_ * eta_ - damping_ * v_)).sum();
  }
  double tip_rotation() const override { return modes_.tip_rotation.dot(eta_.matrix()); }
  double tip_displacement_integral() const override { return now_.integral; }
  double tip_displacement_integral_2() const override { return now_.integral_2; }
  double kinetic_energy() const override { return 0.5 * v_.square().sum(); }
  double strain_energy() const override { return 0.5 * (modes_.omega.array() * eta_).square().sum(); }
  double dissipated_energy() const override {
    add_loss();
    return now_.dissipated;
  }
  double load_potential() const override { return -(load_ * eta_).sum(); }
  double tip_mass() const override { return 1.0 / inverse_tip_mass_; }
  double static_tip_compliance() const override { return compliance_; }
  void deflection(std::array<double, shape_points>& u) const override {
    Eigen::Map<Eigen::VectorXd>(u.data(), shape_points).noalias() = modes_.deflection * eta_.matrix();
  }
  void rotation(std::array<double, shape_points>& theta) const override {
    Eigen::Map<Eigen::VectorXd>(theta.data(), shape_points).noalias() = modes_.rotation * eta_.matrix();
  }
  std::vector<double> frequencies() const override {
    std::vector<double> omega(modes_.omega.data(), modes_.omega.data() + modes_.omega.size());
    std::sort(omega.begin(), omega.end());
    return omega;
  }

  void save(std::vector<double>& state) const override {
    add_loss();
    const auto m = static_cast<std::size_t>(eta_.size());
    state.resize(2 * m + 5);
    Eigen::Map<ArrayXd>(state.data(), eta_.size()) = eta_;
    Eigen::Map<ArrayXd>(state.data() + m, eta_.size()) = v_;
    double* rest = state.data() + 2 * m;
    rest[0] = now_.integral;
    rest[1] = now_.integral_2;
    rest[2] = now_.dissipated;
    rest[3] = now_.end_force;
    rest[4] = distributed_load_;
  }

  void restore(const std::vector<double>& state) override {
    loss_step_.size = 0.0;
    const auto m = static_cast<std::size_t>(eta_.size());
    eta_ = Eigen::Map<const ArrayXd>(state.data(), eta_.size());
    v_ = Eigen::Map<const ArrayXd>(state.data() + m, eta_.size());
    const double* rest = state.data() + 2 * m;
    now_.integral = rest[0];
    now_.integral_2 = rest[1];
    now_.dissipated = rest[2];
    now_.end_force = rest[3];
    set_distributed_load(rest[4]);
    update_tip();
  }

 private:
  void make_coefficients(double h, Coefficients& k) const {
    const Index m = eta_.size();
    for (ArrayXd* array :
         {&k.phi_G1, &k.phi_G2, &k.phi_G3, &k.integral_eta, &k.integral_v, &k.integral2_eta, &k.integral2_v}) {
      array->resize(m);
    }
    k.integral_input.fill(0.0);
    k.integral2_input.fill(0.0);
    if (damped_) {
      for (ArrayXd* array : {&k.one_minus_decay, &k.G0, &k.G1}) array->resize(m);
    } else {
      for (ArrayXd* array : {&k.sign, &k.kick, &k.drift, &k.reflection}) array->resize(m);
    }
    for (Index i = 0; i < m; ++i) {
      const double phi = tip_[i], c = damping_[i];
      const OscillatorResponse response = oscillator_response(modes_.omega[i], c, h);
      const std::array<double, 6>& G = response.G;
      k.phi_G1[i] = phi * G[1];
      k.phi_G2[i] = phi * G[2];
      k.phi_G3[i] = phi * G[3];
      k.integral_eta[i] = phi * (G[0] + c * G[1]);
      k.integral_v[i] = phi * G[1];
      k.integral2_eta[i] = phi * (G[1] + c * G[2]);
      k.integral2_v[i] = phi * G[2];
      const std::array<double, 3> force = {phi, modes_.uniform_load[i], modes_.hat_load[i]};
      for (std::size_t j = 0; j < 3; ++j) {
        k.integral_input[j] += phi * phi * G[j + 2];
        k.integral2_input[j] += phi * phi * G[j + 3];
      }
      for (std::size_t j = 1; j < 3; ++j) {
        k.integral_input[j + 2] += phi * force[j] * G[2];
        k.integral2_input[j + 2] += phi * force[j] * G[3];
      }
      if (damped_) {
        k.one_minus_decay[i] = omega2_[i] * G[1] + c * G[0];
        k.G0[i] = G[0];
        k.G1[i] = G[1];
      } else {
        const UndampedStep undamped = undamped_step(modes_.omega[i], h);
        k.sign[i] = undamped.sign;
        k.kick[i] = undamped.kick;
        k.drift[i] = undamped.drift;
        k.reflection[i] = (1.0 - undamped.sign) / omega2_[i];
      }
    }
  }

  void make_dissipation(double h, Dissipation& k) const {
    const Index m = eta_.size();
    for (ArrayXd* array : {&k.vv, &k.vr, &k.rr, &k.v1, &k.v2, &k.r1, &k.r2}) array->resize(m);
    k.input.fill(0.0);
    for (Index i = 0; i < m; ++i) {
      const double phi = tip_[i];
      const std::array<double, 10> Q = oscillator_dissipation(modes_.omega[i], damping_[i], h);
      k.vv[i] = Q[0];
      k.vr[i] = 2.0 * Q[1];
      k.v1[i] = 2.0 * phi * Q[2];
      k.v2[i] = 2.0 * phi * Q[3];
      k.rr[i] = Q[4];
      k.r1[i] = 2.0 * phi * Q[5];
      k.r2[i] = 2.0 * phi * Q[6];
      k.input[0] += phi * phi * Q[7];
      k.input[1] += 2.0 * phi * phi * Q[8];
      k.input[2] += phi * phi * Q[9];
    }
  }

  /// Adds the loss of the last step, which is due only when it is asked for or its work space is needed again: a step
  /// that is tried and taken back, as event location does with ever new sizes, never pays for it.
  void add_loss() const {
    if (loss_step_.size == 0.0) return;
    const Dissipation& k =
        dissipation_.get(loss_step_.size, [this](double h, Dissipation& value) { make_dissipation(h, value); });
    const ArrayXd& v = v_next_;  // before the step
    const double c1 = loss_step_.c1, c2 = loss_step_.c2;
    now_.dissipated +=
        (v * (k.vv * v + k.vr * r_ + c1 * k.v1 + c2 * k.v2) + r_ * (k.rr * r_ + c1 * k.r1 + c2 * k.r2)).sum() +
        (c1 * (c1 * k.input[0] + c2 * k.input[1]) + c2 * c2 * k.input[2]);
    loss_step_.size = 0.0;
  }

  void update_tip() {
    now_.displacement = (tip_ * eta_).sum();
    now_.velocity = (tip_ * v_).sum();
  }

  Modes modes_;
  ArrayXd tip_;      // φ(L) [1/√kg]
  ArrayXd omega2_;   // ω² [1/s²]
  ArrayXd damping_;  // α_b ω² [1/s]
  bool damped_;
  bool ordinary_;     // no coefficient is so large that an output could overflow, see integrator.hpp
  ArrayXd hat_load_;  // modal force of the hat load [N/√kg]
  double hat_coefficient_;
  double inverse_tip_mass_;
  double compliance_;

  ArrayXd eta_, v_;  // state: modal displacement [m √kg] and velocity
  ArrayXd load_;     // modal force of f_b and the hat load [N/√kg]
  double distributed_load_ = 0.0;
  struct Scalars {
    double displacement, velocity, integral, integral_2;
    mutable double dissipated;
    double end_force;  // C at the end of the last step
  };
  Scalars now_{};

  ArrayXd eta_next_, v_next_, force_, r_;  // work space; after a step v_next_ and r_ are those of its start
  struct LossStep {
    double size, c1, c2;
  };
  mutable LossStep loss_step_ = {0.0, 0.0, 0.0};  // the step whose loss is not in `dissipated` yet; size 0: none
  StepCache<Coefficients> coefficients_;
  mutable StepCache<Dissipation> dissipation_;
};

}  // namespace

std::unique_ptr<BeamIntegrator> make_modal_beam(const Parameters& parameters) {
  return std::make_unique<ModalBeam>(parameters);
}

}  // namespace beam
