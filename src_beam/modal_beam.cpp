#include "modal_beam.hpp"

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
  ArrayXd sign, kick, drift;  // undamped
  ArrayXd one_minus_decay;    // damped; 1 − ġ = ω²G₁ + cG₀
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
  /// `modes` are those of `owned`.
  ModalBeam(const Modes& modes, std::unique_ptr<const Modes> owned, const Parameters& p)
      : Beam(std::move(owned), p),
        modes_(modes),
        tip_(modes_.load(Loads::tip)),
        omega2_(modes_.omega.array().square()),
        damping_(p.alpha_b * omega2_),
        damped_(p.alpha_b > 0.0) {
    require_coefficients({1.0 / modes_.omega.minCoeff(), omega2_.maxCoeff(), damping_.maxCoeff()});
    const auto bound = [](const auto& values) { require_coefficients({values.template lpNorm<Eigen::Infinity>()}); };
    bound(modes_.tip_rotations);
    for (const Eigen::VectorXd& load : modes_.loads) bound(load);
    for (const Eigen::MatrixXd* rows : {&modes_.deflections, &modes_.rotations, &modes_.shears, &modes_.moments})
      bound(*rows);
    // What is overdamped has no phase.
    limit_phase((damping_ < 2.0 * modes_.omega.array()).select(modes_.omega.array(), 0.0).maxCoeff());
  }

 private:
  void advance(double size, const Polynomial& c, const Loads& loads) override {
    const auto eta = start_.q.array(), v = start_.v.array();
    auto eta_next = now_.q.array(), v_next = now_.v.array();
    const Coefficients& k = coefficients(size);
    unbooked_ = {size, c[1] != 0.0 || c[2] != 0.0, loads.any(), false};
    force_[0] = c[0] * tip_;
    if (unbooked_.loaded) {
      for (ArrayXd& load : load_) load.setZero(tip_.size());
      loads.for_each([&](std::size_t i, const Polynomial& f) {
        unbooked_.load_varies = unbooked_.load_varies || f[1] != 0.0 || f[2] != 0.0;
        for (std::size_t j = 0; j < f.size(); ++j) {
          if (f[j] != 0.0) load_[j] += f[j] * modes_.loads[i].array();
        }
      });
      force_[0] += load_[0];
    }
    // As the beam is put at rest, so that it stays there to the last digit.
    equilibrium_ = force_[0] / omega2_;
    r_ = omega2_ * (equilibrium_ - eta);
    if (damped_) {
      eta_next = eta + (k.G[0] * v + k.G[1] * r_);
      v_next = v + (k.G[0] * r_ - k.one_minus_decay * v);
    } else {
      v_next = v + k.kick * r_;
      eta_next = eta + k.drift * v_next;
      v_next = k.sign * (v_next + k.kick * (omega2_ * (equilibrium_ - eta_next)));
      eta_next = k.sign * eta_next + (1.0 - k.sign) * equilibrium_;
    }
    unbooked_.varying = unbooked_.varying || unbooked_.load_varies;
    if (unbooked_.varying) {
      for (std::size_t j = 1; j < force_.size(); ++j) {
        force_[j] = c[j] * tip_;
        if (unbooked_.load_varies) force_[j] += load_[j];
      }
      eta_next += k.G[2] * force_[1] + k.G[3] * force_[2];
      v_next += k.G[1] * force_[1] + k.G[2] * force_[2];
    }
    const auto integral = [&](std::size_t j) {
      const Coefficients::Integral& of = k.integral[j];
      double sum = (of.eta * eta + of.v * v).sum() + dot(of.force, c);
      if (unbooked_.loaded) {
        sum += (tip_ * (k.G[j + 2] * load_[0] + k.G[j + 3] * load_[1] + k.G[j + 4] * load_[2])).sum();
      }
      return sum;
    };
    now_.scalars.integral = integral(0);
    now_.scalars.integral_2 = integral(1);
  }

  void make_coefficients(double h, Coefficients& k) const {
    const Index m = tip_.size();
    for (ArrayXd& G : k.G) G.resize(m);
    for (ArrayXd* array : {&k.one_minus_decay, &k.sign, &k.kick, &k.drift}) array->resize(m);
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
      }
    }
  }

  void make_dissipation(double h, Dissipation& Q) const {
    for (ArrayXd& row : Q) row.resize(tip_.size());
    for (Index i = 0; i < tip_.size(); ++i) {
      const std::array<double, 10> entries = oscillator_dissipation(modes_.omega[i], damping_[i], h);
      for (std::size_t j = 0; j < entries.size(); ++j) Q[j][i] = entries[j];
    }
  }

  void book_step() const override {
    if (damped_) now_.scalars.dissipated += loss();
    if (unbooked_.loaded) now_.scalars.load_work += work();
  }

  double loss() const {
    const Dissipation& Q =
        dissipation_.get(unbooked_.size, [this](double h, Dissipation& value) { make_dissipation(h, value); });
    const auto v = start_.v.array();
    const ArrayXd &force1 = force_[1], &force2 = force_[2];
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
    const auto rise = (now_.q - start_.q).array();
    double sum = (load_[0] * rise).sum();
    if (unbooked_.load_varies) {
      const auto v = start_.v.array();
      const auto& G = coefficients(h).G;
      const ArrayXd Z1 = G[1] * v + G[2] * r_ + G[3] * force_[1] + G[4] * force_[2];
      const auto Z2 = G[2] * v + G[3] * r_ + G[4] * force_[1] + G[5] * force_[2];
      sum += (load_[1] * (h * rise - Z1) + load_[2] * (0.5 * h * h * rise - h * Z1 + Z2)).sum();
    }
    return sum;
  }

  const Coefficients& coefficients(double size) const {
    return coefficients_.get(size, [this](double h, Coefficients& value) { make_coefficients(h, value); });
  }

  const Modes& modes_;
  ArrayXd tip_;      // φ(L) [1/√kg]
  ArrayXd omega2_;   // ω² [1/s²]
  ArrayXd damping_;  // α_b ω² [1/s]
  bool damped_;

  // The last step.
  ArrayXd equilibrium_,
      r_;  // where its first force would hold the modes, and what of that force their displacement leaves
  std::array<ArrayXd, 3> force_, load_;  // modal force and its part that is the loads', with their rates [N/√kg, …]
  struct Unbooked {
    double size;
    bool varying, loaded, load_varies;
  } unbooked_{};
  mutable StepCache<Coefficients> coefficients_;
  mutable StepCache<Dissipation> dissipation_;
};

}  // namespace

std::unique_ptr<Beam> make_modal_beam(const Timoshenko& mesh, const Parameters& parameters) {
  auto modes = std::make_unique<const Modes>(compute_modes(mesh, parameters.n_modes));
  const Modes& numerics = *modes;
  return std::make_unique<ModalBeam>(numerics, std::move(modes), parameters);
}

}  // namespace beam
