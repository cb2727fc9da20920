#include "motion.hpp"

#include <cmath>

namespace spring {

Loads Loads::from(const Parameters& parameters, const Inputs& inputs) {
  Loads loads{load_of(parameters, inputs), inputs.tip_displacement};
  for (std::size_t i = 0; i < 3; ++i) {
    const double N = parameters.stop_enabled ? 0.0 : inputs.foundation_force[i];
    const double contact = N - inputs.contact_force[i];
    loads.held = loads.held || contact != 0.0;
    loads.force[i] += contact;
  }
  return loads;
}

Quadratic load_of(const Parameters& parameters, const Inputs& inputs) {
  Quadratic load;
  for (std::size_t i = 0; i < 3; ++i)
    load[i] = inputs.external_force[i] - parameters.mass * inputs.base_acceleration[i];
  return load;
}

Motion::Motion(const Parameters& parameters)
    : mass_(parameters.mass),
      damping_(parameters.damping),
      k1_(parameters.linear_stiffness),
      k2_(parameters.cubic_stiffness),
      compliance_(parameters.compliance_stiffness, parameters.compliance_exponent, parameters.compliance_damping) {}

double Motion::acceleration(double y, double z, double force, double contact) const {
  return (force - damping_ * z - (k1_ + k2_ * y * y) * y - contact) / mass_;
}

double Motion::acceleration_by_displacement(double y, double contact_slope) const {
  return -(k1_ + 3.0 * k2_ * y * y + contact_slope) / mass_;
}

std::array<double, 6> Motion::derivatives(double y, double z, const Loads& loads, bool touching, double depth) const {
  const double k = k1_ + 3.0 * k2_ * y * y;  // tangent stiffness
  const auto& F = loads.force;
  const auto& u = loads.tip;
  std::array<double, 6> d{y, z};
  double &a = d[2], &j = d[3], &s = d[4];
  // The contact's n-th derivative needs the motion's (n+1)-th: each is known when it is its turn.
  const auto contact = [&](std::size_t n) {
    return touching ? compliance_.rates({depth, z - u[1], a - u[2], j, s})[n] : 0.0;
  };
  a = acceleration(y, z, F[0], contact(0));
  j = (F[1] - damping_ * a - k * z - contact(1)) / mass_;
  s = (F[2] - damping_ * j - k * a - 6.0 * k2_ * y * z * z - contact(2)) / mass_;
  d[5] = (-damping_ * s - k * j - 18.0 * k2_ * y * z * a - 6.0 * k2_ * z * z * z - contact(3)) / mass_;
  return d;
}

std::array<double, 13> Motion::remainder(const Taylor& R, const Loads& loads) const {
  constexpr std::size_t n = Taylor::max_order + 1;
  const std::array<double, n> c = R.coefficients();
  std::array<double, 2 * n - 1> square{};
  std::array<double, 13> r{};
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) square[i + j] += c[i] * c[j];
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < square.size(); ++j) r[i + j] -= k2_ * c[i] * square[j];
  for (std::size_t k = 0; k < n; ++k) r[k] -= k1_ * c[k];
  for (std::size_t k = 1; k < n; ++k) r[k - 1] -= damping_ * static_cast<double>(k) * c[k];
  for (std::size_t k = 2; k < n; ++k) r[k - 2] -= mass_ * static_cast<double>(k * (k - 1)) * c[k];
  const auto& F = loads.force;
  r[0] += F[0];
  r[1] += F[1];
  r[2] += F[2] / 2;
  for (int k = 0; k < R.order() - 1; ++k) r[static_cast<std::size_t>(k)] = 0.0;
  return r;
}

double Motion::acceleration_scale(double y, double z, double force, double contact) const {
  return (std::abs(force) + std::abs(damping_ * z) + (std::abs(k1_) + std::abs(k2_) * y * y) * std::abs(y) +
          std::abs(contact)) /
         mass_;
}

double Motion::rate(double reach, const Compliance::Slopes& contact) const {
  const double stiffness = std::abs(k1_) + 3.0 * std::abs(k2_) * reach * reach + contact.force_by_depth;
  return std::sqrt(stiffness / mass_) + (damping_ + contact.force_by_rate) / mass_;
}

Quadratic Motion::holding_force(double y, const Loads& loads, bool touching, double depth) const {
  std::array<double, 4> contact{};
  if (touching) contact = compliance_.rates({depth, -loads.tip[1], -loads.tip[2], 0.0, 0.0});
  return {(k1_ + k2_ * y * y) * y + contact[0] - loads.force[0], contact[1] - loads.force[1],
          contact[2] - loads.force[2]};
}

double Motion::potential_energy(double y) const { return (k1_ / 2 + k2_ / 4 * y * y) * y * y; }

}  // namespace spring
