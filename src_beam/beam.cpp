#include "beam.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

#include "generalized_alpha.hpp"
#include "modal_beam.hpp"
#include "text.hpp"

namespace beam {

namespace {

[[noreturn]] void reject(const char* name, double value, const std::string& allowed) {
  throw std::invalid_argument(std::string("beam: ") + name + " = " + number(value) + " is not allowed; it must be " +
                              allowed);
}

/// @throws std::invalid_argument for the first parameter that is not allowed beside the others
void validate(const Parameters& p) {
  if (p.n_elements > max_elements / p.element_degree) {
    reject("n_elements", p.n_elements,
           "between 1 and " + std::to_string(max_elements / p.element_degree) + " (" + std::to_string(max_elements) +
               " over element_degree)");
  }
  if (p.integrator != Integrator::modal) return;
  const int unknowns = 2 * p.n_elements * p.element_degree;
  const std::string mesh = std::to_string(p.n_elements) + " elements of degree " + std::to_string(p.element_degree);
  if (p.n_modes > unknowns) {
    reject("n_modes", p.n_modes, "between 0 (all) and " + std::to_string(unknowns) + ", the unknowns of " + mesh);
  }
  const int most = std::min({unknowns / 2, max_dense_unknowns, max_mode_values / unknowns});
  if (unknowns > max_dense_unknowns && (p.n_modes == 0 || p.n_modes > most)) {
    reject("n_modes", p.n_modes,
           "between 1 and " + std::to_string(most) + " with " + mesh + " (all modes only up to " +
               std::to_string(max_dense_unknowns) +
               " unknowns); keep fewer n_modes, or use the integrator generalized_alpha");
  }
}

[[noreturn]] void throw_too_large(double size, const Polynomial& c, const Loads& loads) {
  std::string message = "beam: the result is not finite or too large after a step of " + number(size) +
                        " s under the tip force " + number(c[0]) + " N, " + number(c[1]) + " N/s, " + number(c[2]) +
                        " N/s2";
  loads.for_each([&message](std::size_t i, const Polynomial& f) {
    message += std::string(", ") + Loads::names[i] + " = " + number(f[0]) + " and its derivatives " + number(f[1]) +
               ", " + number(f[2]);
  });
  throw std::domain_error(message + "; the state is unchanged, use a smaller step or smaller inputs");
}

}  // namespace

std::unique_ptr<Beam> make_beam(const Parameters& parameters) {
  validate(parameters);
  return parameters.integrator == Integrator::modal ? make_modal_beam(parameters)
                                                    : make_generalized_alpha_beam(parameters);
}

void Beam::step(double size, const Polynomial& c, const Loads& loads) {
  double inputs = 0.0;
  for (const double value : c) inputs += std::abs(value);
  loads.for_each([&inputs](std::size_t, const Polynomial& f) {
    for (const double value : f) inputs += std::abs(value);
  });
  book();
  const Scalars before = now_;
  const double squares = advance(size, c, loads);
  now_.tip_force = value(c, size);
  now_.loads = loads.at(size);
  if (squares < largest && inputs < largest && size < largest_size) return;
  undo();
  now_ = before;
  throw_too_large(size, c, loads);
}

void Beam::require_coefficients(std::initializer_list<double> values) {
  for (const double value : values) {
    if (!(value < largest_coefficient)) throw std::invalid_argument("beam: the parameters leave the range of numbers");
  }
}

void Beam::apply_tip_impulse(double impulse) {
  if (!(std::abs(impulse) < largest)) throw_too_large(0.0, {impulse, 0.0, 0.0}, {});
  book();
  strike(impulse);
}

void Beam::observe(double tip_force, const Loads& loads) {
  now_.tip_force = tip_force;
  now_.loads = loads.at(0.0);
}

double Beam::load_potential() const {
  double work = 0.0;
  for (const Loads::Shape i : {Loads::distributed, Loads::hat}) work += now_.loads[i] * load_work_per_unit(i);
  return -work;
}

double Beam::load_potential_rate() const {
  double power = 0.0;
  for (const Loads::Shape i : {Loads::distributed, Loads::hat}) power += now_.loads[i] * load_power_per_unit(i);
  return -power;
}

double Beam::load_power() const {
  double power = 0.0;
  for (std::size_t i = 0; i < Loads::count; ++i) power += now_.loads[i] * load_power_per_unit(i);
  return power;
}

/// Puts the state back.
class Beam::Trial {
 public:
  explicit Trial(Beam& beam) : beam_(beam) { beam_.save(state_); }
  Trial(const Trial&) = delete;
  Trial& operator=(const Trial&) = delete;
  ~Trial() { beam_.restore(state_); }
  /// At rest, under nothing.
  void clear() { beam_.restore(std::vector<double>(state_.size(), 0.0)); }

 private:
  Beam& beam_;
  std::vector<double> state_;
};

Beam::Forecast Beam::forecast(double size) {
  const Trial trial(*this);
  const double u = tip_displacement(), v = tip_velocity();
  Loads loads;
  for (std::size_t i = 0; i < Loads::count; ++i) loads.set(i, {now_.loads[i], 0.0, 0.0});
  for (int i = 0; i < 2; ++i) step(size, {}, loads);
  return {(tip_displacement() - u) / (2.0 * size), (tip_velocity() - v) / (2.0 * size)};
}

Beam::Forecast Beam::forecast_per_load(double size, std::size_t shape) {
  Trial trial(*this);
  trial.clear();
  now_.loads[shape] = 1.0;
  return forecast(size);
}

Beam::Response Beam::response_per_load(std::size_t shape) {
  Trial trial(*this);
  trial.clear();
  (shape == Loads::count ? now_.tip_force : now_.loads[shape]) = 1.0;
  return response(Order::value);
}

std::array<double, 3> Beam::tip_response(double size) {
  Trial trial(*this);
  trial.clear();
  std::array<double, 3> response{};
  step(size, {1.0, 0.0, 0.0}, {});
  response[0] = tip_displacement();
  step(size, {}, {});
  response[1] = tip_displacement();
  trial.clear();
  apply_tip_impulse(1.0);
  response[2] = forecast(size).velocity;
  return response;
}

void Beam::save(std::vector<double>& state) const {
  book();
  state.resize(motion_size_ + sizeof now_ / sizeof(double));
  save_motion(state.data());
  std::memcpy(state.data() + motion_size_, &now_, sizeof now_);
}

void Beam::restore(const std::vector<double>& state) {
  if (state.size() != motion_size_ + sizeof now_ / sizeof(double))
    throw std::invalid_argument("beam: a saved state of " + std::to_string(state.size()) +
                                " numbers does not belong to this beam");
  restore_motion(state.data());
  std::memcpy(&now_, state.data() + motion_size_, sizeof now_);
}

}  // namespace beam
