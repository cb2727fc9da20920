#include "equation_of_motion.hpp"

#include <cmath>
#include <limits>

namespace spring {
namespace {

/// Coefficient k of a force as a power series.
double coefficient(const Polynomial& force, std::size_t k) { return k < 2 ? force[k] : k == 2 ? force[2] / 2 : 0.0; }

}  // namespace

Loads Loads::from(const Parameters& parameters, const Inputs& inputs) {
  Loads loads{load_of(parameters, inputs), inputs.tip_displacement};
  for (std::size_t i = 0; i < 3; ++i) {
    const double N = parameters.stop_enabled ? 0.0 : inputs.foundation_force[i];
    loads.force[i] += N - inputs.contact_force[i];
  }
  return loads;
}

Polynomial load_of(const Parameters& parameters, const Inputs& inputs) {
  Polynomial load;
  for (std::size_t i = 0; i < 3; ++i)
    load[i] = inputs.external_force[i] - parameters.mass * inputs.base_acceleration[i];
  return load;
}

Compliance contact_of(const Parameters& p) {
  const bool voigt = p.contact_law == ContactLaw::kelvin_voigt;
  return {p.compliance_stiffness, p.compliance_exponent, voigt ? 0.0 : p.compliance_damping,
          voigt ? p.contact_damping : 0.0};
}

EquationOfMotion::EquationOfMotion(const Parameters& parameters)
    : mass_(parameters.mass),
      damping_(parameters.damping),
      k1_(parameters.linear_stiffness),
      k2_(parameters.cubic_stiffness),
      unloaded_(parameters.unloaded),
      compliance_(contact_of(parameters)) {}

double EquationOfMotion::acceleration(double y, double z, double force, double contact) const {
  return (force - damping_ * z - spring_force(y) - contact) / mass_;
}

double EquationOfMotion::acceleration_by_displacement(double y, double contact_slope) const {
  const double x = elongation(y);
  return -(k1_ + 3.0 * k2_ * x * x + contact_slope) / mass_;
}

Expansion::Expansion(double x, double z, double depth, const Loads& loads, double size, bool touching)
    : size(size),
      loads(loads.scaled(size)),
      touching(touching),
      x{x, size * z},
      depth{depth, size * z - this->loads.tip[1], -this->loads.tip[2] / 2} {}

void Expansion::shorten(double factor, const Loads& unscaled) {
  size *= factor;
  loads = unscaled.scaled(size);
  double power = 1.0;
  for (std::size_t k = 0; k < x.size(); ++k, power *= factor) {
    x[k] *= power;
    depth[k] *= power;
    contact.elastic[k] *= power;
    contact.damping[k] *= power;
  }
}

void EquationOfMotion::extend(Expansion& motion) const {
  auto& [size, loads, touching, x, square, depth, contact, highest] = motion;
  const std::size_t k = highest - 1;
  double cube = 0.0;
  for (std::size_t i = 0; i <= k; ++i) square[k] += x[i] * x[k - i];
  for (std::size_t i = 0; i <= k; ++i) cube += x[i] * square[k - i];
  if (touching) compliance_.extend(contact, k, depth, size);
  const double n = static_cast<double>(k);
  const double force = coefficient(loads.force, k) - k1_ * x[k] - k2_ * cube - damping_ * (n + 1.0) * x[k + 1] / size -
                       contact.elastic[k] - contact.damping[k];
  x[++highest] = force / mass_ * size * size / ((n + 1.0) * (n + 2.0));
  depth[highest] += x[highest];
}

double EquationOfMotion::residual(const Expansion& motion) const {
  constexpr double rounding = 4.0 * std::numeric_limits<double>::epsilon();
  double x = 0.0, rate = 0.0, depth = 0.0, depth_rate = 0.0, acceleration = 0.0, magnitude = 0.0;
  for (std::size_t k = 0; k < motion.highest; ++k) {
    const double n = static_cast<double>(k), second = n * (n - 1.0) * motion.x[k];
    x += motion.x[k];
    rate += n * motion.x[k];
    depth += motion.depth[k];
    depth_rate += n * motion.depth[k];
    acceleration += second;
    magnitude += std::abs(second);
  }
  const double size = motion.size, per_force = size * size / mass_;
  const double contact = motion.touching ? compliance_.continued(depth, depth_rate / size).force : 0.0;
  for (const double force :
       {value(motion.loads.force, 1.0), -k1_ * x, -k2_ * x * x * x, -damping_ * rate / size, -contact}) {
    acceleration -= per_force * force;
    magnitude += per_force * std::abs(force);
  }
  const double left = std::abs(acceleration) - rounding * magnitude;
  return left <= 0.0 ? 0.0 : left;
}

EquationOfMotion::Rates EquationOfMotion::rates(double reach, const Compliance::Slopes& contact) const {
  const double stiffness = std::abs(k1_) + 3.0 * std::abs(k2_) * reach * reach + contact.force_by_depth;
  return {std::sqrt(stiffness / mass_), (damping_ + contact.force_by_rate) / mass_};
}

Polynomial EquationOfMotion::holding_force(double y, const Loads& loads, bool touching, double depth) const {
  Compliance::Along contact;
  Polynomial force{spring_force(y), 0.0, 0.0};
  for (std::size_t k = 0; k < 3; ++k) {
    if (touching) compliance_.extend(contact, k, {depth, -loads.tip[1], -loads.tip[2] / 2}, 1.0);
    force[k] += (contact.elastic[k] + contact.damping[k]) * (k == 2 ? 2.0 : 1.0) - loads.force[k];
  }
  return force;
}

double EquationOfMotion::potential_energy(double y) const {
  const double square = elongation(y) * elongation(y);
  return (k1_ / 2 + k2_ / 4 * square) * square;
}

}  // namespace spring
