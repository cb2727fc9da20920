#include "modal_beam.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <utility>

#include "modal_oscillator.hpp"
#include "modes.hpp"
#include "step_cache.hpp"

namespace beam {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;

/// Structure of arrays over the modes, G_k as in modal_oscillator.hpp; φ stands for φ(L).
struct Coefficients {
  ArrayXd sign, kick, drift, reflection;  // undamped; reflection = (1 − sign)/ω²
  ArrayXd one_minus_decay;                // damped; 1 − ġ = ω²G₁ + cG₀
  std::array<ArrayXd, 6> G;
  struct Integral {  // from η₀ and v₀ per mode; from the tip force in sum
    ArrayXd eta, v;
    Polynomial force;
  };
  std::array<Integral, 2> integral;  // ∫u, ∫∫u
};

/// The quadratic form of oscillator_dissipation(), a row per entry.
using Dissipation = std::array<ArrayXd, 10>;

double dot(const Polynomial& a, const Polynomial& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

class ModalBeam final : public Beam {
 public:
  ModalBeam(const Parameters& p, Modes modes)
      : Beam(static_cast<std::size_t>(2 * modes.omega.size())),
        modes_(std::move(modes)),
        tip_(modes_.tip),
        omega2_(modes_.omega.array().square()),
        damping_(p.alpha_b * omega2_),
        damped_(p.alpha_b > 0.0),
        eta_(p.initial_deflection_slope * modes_.linear_shape.array()),
        v_(p.initial_velocity_slope * modes_.linear_shape.array()),
        eta_next_(eta_.size()),
        v_next_(eta_.size()) {
    require_coefficients({1.0 / modes_.omega.minCoeff(), omega2_.maxCoeff(), damping_.maxCoeff()});
    const auto bound = [](const auto& values) { require_coefficients({values.template lpNorm<Eigen::Infinity>()}); };
    bound(modes_.tip);
    bound(modes_.tip_rotation);
    for (const Eigen::VectorXd& load : modes_.loads) bound(load);
    for (const Eigen::MatrixXd* rows : {&modes_.deflection, &modes_.rotation, &modes_.shear, &modes_.moment})
      bound(*rows);
  }

  double tip_displacement() const override { return (tip_ * eta_).sum(); }
  double tip_velocity() const override { return (tip_ * v_).sum(); }
  Response response(Order order, const Loads::Values& loads_rate, double tip_force_rate) const override {
    const ArrayXd now = acceleration();
    if (order == Order::value) return respond(now, now_.loads, now_.tip_force);
    const ArrayXd jerk = modal_force(loads_rate, tip_force_rate) - omega2_ * v_ - damping_ * now;
    return respond(jerk, loads_rate, tip_force_rate);
  }
  void rest() override {
    unbooked_.size = 0.0;
    eta_ = modal_force(now_.loads, now_.tip_force) / omega2_;
    v_.setZero();
  }
  double tip_rotation_rate() const override { return modes_.tip_rotation.dot(v_.matrix()); }
  double kinetic_power() const override { return (v_ * acceleration()).sum(); }
  double strain_power() const override { return (omega2_ * eta_ * v_).sum(); }
  double dissipated_power() const override { return (damping_ * v_.square()).sum(); }
  double load_power_per_unit(std::size_t i) const override { return modes_.loads[i].dot(v_.matrix()); }
  double tip_rotation() const override { return modes_.tip_rotation.dot(eta_.matrix()); }
  double kinetic_energy() const override { return 0.5 * v_.square().sum(); }
  double strain_energy() const override { return 0.5 * (modes_.omega.array() * eta_).square().sum(); }
  double load_work_per_unit(std::size_t i) const override { return modes_.loads[i].dot(eta_.matrix()); }
  double tip_mass() const override { return 1.0 / tip_.square().sum(); }
  void deflection(Shape& u) const override {
    Eigen::Map<Eigen::VectorXd>(u.data(), shape_points).noalias() = modes_.deflection * eta_.matrix();
  }
  void rotation(Shape& theta) const override {
    Eigen::Map<Eigen::VectorXd>(theta.data(), shape_points).noalias() = modes_.rotation * eta_.matrix();
  }

 private:
  double advance(double size, const Polynomial& c, const Loads& loads) override {
    const Coefficients& k = coefficients(size);
    const bool loaded = loads.any();
    bool load_varies = false;
    force_[0] = c[0] * tip_;
    if (loaded) {
      for (ArrayXd& load : load_) load.setZero(eta_.size());
      loads.for_each([&](std::size_t i, const Polynomial& f) {
        load_varies = load_varies || f[1] != 0.0 || f[2] != 0.0;
        for (std::size_t j = 0; j < f.size(); ++j) {
          if (f[j] != 0.0) load_[j] += f[j] * modes_.loads[i].array();
        }
      });
      force_[0] += load_[0];
    }
    r_ = force_[0] - omega2_ * eta_;
    if (damped_) {
      eta_next_ = eta_ + (k.G[0] * v_ + k.G[1] * r_);
      v_next_ = v_ + (k.G[0] * r_ - k.one_minus_decay * v_);
    } else {
      v_next_ = v_ + k.kick * r_;
      eta_next_ = eta_ + k.drift * v_next_;
      v_next_ = k.sign * (v_next_ + k.kick * (force_[0] - omega2_ * eta_next_));
      eta_next_ = k.sign * eta_next_ + k.reflection * force_[0];
    }
    const bool varying = c[1] != 0.0 || c[2] != 0.0 || load_varies;
    if (varying) {
      for (std::size_t j = 1; j < force_.size(); ++j) {
        force_[j] = c[j] * tip_;
        if (load_varies) force_[j] += load_[j];
      }
      eta_next_ += k.G[2] * force_[1] + k.G[3] * force_[2];
      v_next_ += k.G[1] * force_[1] + k.G[2] * force_[2];
    }
    const auto integral = [&](std::size_t j) {
      const Coefficients::Integral& of = k.integral[j];
      double sum = (of.eta * eta_ + of.v * v_).sum() + dot(of.force, c);
      if (loaded) sum += (tip_ * (k.G[j + 2] * load_[0] + k.G[j + 3] * load_[1] + k.G[j + 4] * load_[2])).sum();
      return sum;
    };
    now_.integral = integral(0);
    now_.integral_2 = integral(1);
    eta_.swap(eta_next_);
    v_.swap(v_next_);
    if (damped_ || loaded) unbooked_ = {size, varying, loaded, load_varies};
    return (v_.square() + omega2_ * eta_.square()).sum();
  }

  void undo() override {
    unbooked_.size = 0.0;
    eta_.swap(eta_next_);
    v_.swap(v_next_);
  }

  void strike(double impulse) override { v_ += impulse * tip_; }

  void save_motion(double* numbers) const override {
    Eigen::Map<ArrayXd>(numbers, eta_.size()) = eta_;
    Eigen::Map<ArrayXd>(numbers + eta_.size(), eta_.size()) = v_;
  }

  void restore_motion(const double* numbers) override {
    unbooked_.size = 0.0;
    eta_ = Eigen::Map<const ArrayXd>(numbers, eta_.size());
    v_ = Eigen::Map<const ArrayXd>(numbers + eta_.size(), eta_.size());
  }

  void make_coefficients(double h, Coefficients& k) const {
    const Index m = eta_.size();
    for (ArrayXd& G : k.G) G.resize(m);
    for (ArrayXd* array : {&k.one_minus_decay, &k.sign, &k.kick, &k.drift, &k.reflection}) array->resize(m);
    for (Coefficients::Integral& of : k.integral) of = {ArrayXd(m), ArrayXd(m), {}};
    for (Index i = 0; i < m; ++i) {
      const double phi = tip_[i], c = damping_[i];
      const std::array<double, 6> G = oscillator_response(modes_.omega[i], c, h).G;
      for (std::size_t j = 0; j < G.size(); ++j) k.G[j][i] = G[j];
      for (std::size_t j = 0; j < 2; ++j) {
        Coefficients::Integral& of = k.integral[j];
        of.eta[i] = phi * (G[j] + c * G[j + 1]);
        of.v[i] = phi * G[j + 1];
        for (std::size_t l = 0; l < 3; ++l) of.force[l] += phi * phi * G[j + l + 2];
      }
      if (damped_) {
        k.one_minus_decay[i] = omega2_[i] * G[1] + c * G[0];
      } else {
        const UndampedStep undamped = undamped_step(modes_.omega[i], h);
        k.sign[i] = undamped.sign;
        k.kick[i] = undamped.kick;
        k.drift[i] = undamped.drift;
        k.reflection[i] = (1.0 - undamped.sign) / omega2_[i];
      }
    }
  }

  void make_dissipation(double h, Dissipation& Q) const {
    for (ArrayXd& row : Q) row.resize(eta_.size());
    for (Index i = 0; i < eta_.size(); ++i) {
      const std::array<double, 10> entries = oscillator_dissipation(modes_.omega[i], damping_[i], h);
      for (std::size_t j = 0; j < entries.size(); ++j) Q[j][i] = entries[j];
    }
  }

  /// η̈ of each mode under what acts now.
  ArrayXd acceleration() const { return modal_force(now_.loads, now_.tip_force) - omega2_ * eta_ - damping_ * v_; }
  ArrayXd modal_force(const Loads::Values& loads, double tip_force) const {
    ArrayXd force = tip_force * tip_;
    for (std::size_t i = 0; i < Loads::count; ++i) {
      if (loads[i] != 0.0) force += loads[i] * modes_.loads[i].array();
    }
    return force;
  }
  Response respond(const ArrayXd& acceleration, const Loads::Values& loads, double tip_force) const {
    Response response{(tip_ * acceleration).sum(), modes_.resultants.of(loads, tip_force)};
    const Eigen::VectorXd a = acceleration.matrix();
    Eigen::Map<Eigen::VectorXd>(response.forces.shear.data(), shape_points) -= modes_.shear * a;
    Eigen::Map<Eigen::VectorXd>(response.forces.moment.data(), shape_points) -= modes_.moment * a;
    return response;
  }

  /// Due only when it is asked for or its work space is needed again: a step that is tried and taken back, as event
  /// location does with ever new sizes, never pays for it.
  void book() const override {
    if (unbooked_.size == 0.0) return;
    if (damped_) now_.dissipated += loss();
    if (unbooked_.loaded) now_.load_work += work();
    unbooked_.size = 0.0;
  }

  double loss() const {
    const Dissipation& Q =
        dissipation_.get(unbooked_.size, [this](double h, Dissipation& value) { make_dissipation(h, value); });
    const ArrayXd &v = v_next_, &force1 = force_[1], &force2 = force_[2];  // v before the step
    double sum = (v * (Q[0] * v + 2.0 * Q[1] * r_) + Q[4] * r_.square()).sum();
    if (unbooked_.varying) {
      sum += (2.0 * force1 * (Q[2] * v + Q[5] * r_ + Q[8] * force2) + 2.0 * force2 * (Q[3] * v + Q[6] * r_) +
              Q[7] * force1.square() + Q[9] * force2.square())
                 .sum();
    }
    return sum;
  }

  double work() const {
    const double h = unbooked_.size;
    const auto rise = eta_ - eta_next_;  // which is from before the step
    double sum = (load_[0] * rise).sum();
    if (unbooked_.load_varies) {
      const Coefficients& k = coefficients(h);
      const ArrayXd& v = v_next_;
      const auto& G = k.G;
      const ArrayXd Z1 = G[1] * v + G[2] * r_ + G[3] * force_[1] + G[4] * force_[2];
      const auto Z2 = G[2] * v + G[3] * r_ + G[4] * force_[1] + G[5] * force_[2];
      sum += (load_[1] * (h * rise - Z1) + load_[2] * (0.5 * h * h * rise - h * Z1 + Z2)).sum();
    }
    return sum;
  }

  const Coefficients& coefficients(double size) const {
    return coefficients_.get(size, [this](double h, Coefficients& value) { make_coefficients(h, value); });
  }

  Modes modes_;
  ArrayXd tip_;      // φ(L) [1/√kg]
  ArrayXd omega2_;   // ω² [1/s²]
  ArrayXd damping_;  // α_b ω² [1/s]
  bool damped_;

  ArrayXd eta_, v_;  // state: modal displacement [m √kg] and velocity

  // Work space; after a step all of it is that of its start.
  ArrayXd eta_next_, v_next_, r_;
  std::array<ArrayXd, 3> force_, load_;  // modal force and its part that is the loads', with their rates [N/√kg, …]
  struct Unbooked {
    double size;
    bool varying, loaded, load_varies;
  };
  mutable Unbooked unbooked_{};  // the step that is not in `now_` yet; size 0: none
  mutable StepCache<Coefficients> coefficients_;
  mutable StepCache<Dissipation> dissipation_;
};

}  // namespace

std::unique_ptr<Beam> make_modal_beam(const Parameters& parameters) {
  return std::make_unique<ModalBeam>(parameters, compute_modes(Timoshenko(parameters), parameters));
}

}  // namespace beam
