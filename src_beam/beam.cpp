#include "beam.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "generalized_alpha.hpp"
#include "modal_beam.hpp"
#include "validate.hpp"

namespace beam {
namespace {

[[noreturn]] void throw_not_finite(double size, const Polynomial& c, const Polynomial& f) {
  std::ostringstream message;
  message.precision(17);
  message << "beam: the result is not finite after a step of " << size << " s under the tip force " << c[0] << " N, "
          << c[1] << " N/s, " << c[2] << " N/s2 and the load " << f[0] << " N/m, " << f[1] << " N/m/s, " << f[2]
          << " N/m/s2; the state is unchanged, use a smaller step or smaller inputs";
  throw std::domain_error(message.str());
}

}  // namespace

std::unique_ptr<Beam> make_beam(const Parameters& parameters) {
  validate(parameters);
  return parameters.integrator == Integrator::modal ? make_modal_beam(parameters)
                                                    : make_generalized_alpha_beam(parameters);
}

Beam::Beam(const Parameters& parameters, std::size_t motion_size)
    : hat_(parameters.tip_load_coefficient), motion_size_(motion_size) {}

void Beam::step(double size, const Polynomial& c, const Polynomial& f) {
  require_step_size(size);
  double inputs = 0.0;
  for (std::size_t i = 0; i < c.size(); ++i) inputs += std::abs(c[i]) + std::abs(f[i]);
  if (!(inputs < ordinary)) {
    for (const double value : c) require_finite("tip_force and its derivatives", value);
    for (const double value : f) require_finite("distributed_load and its derivatives", value);
  }
  now_.dissipated = dissipated_energy();
  const Scalars before = now_;
  const double squares = advance(size, c, f);
  now_.tip_force = value_at(c, size);
  now_.distributed_load = value_at(f, size);
  const bool harmless = ordinary_ && squares < ordinary && inputs < ordinary && size < ordinary_size;
  if (harmless || outputs_finite()) return;
  undo();
  now_ = before;
  throw_not_finite(size, c, f);
}

void Beam::apply_tip_impulse(double impulse) {
  require_finite("tip_impulse [N.s]", impulse);
  if (!std::isfinite(tip_velocity() + impulse / tip_mass())) throw_not_finite(0.0, {impulse, 0.0, 0.0}, {});
  strike(impulse);
}

void Beam::observe(double tip_force, double distributed_load) {
  require_finite("tip_force [N]", tip_force);
  require_finite("distributed_load [N/m]", distributed_load);
  now_.tip_force = tip_force;
  now_.distributed_load = distributed_load;
}

double Beam::load_potential() const { return -(now_.distributed_load * deflection_integral() + hat_ * hat_work()); }

bool Beam::outputs_finite() const {
  Shape u{}, theta{};
  deflection(u);
  rotation(theta);
  const auto finite = [](double value) { return std::isfinite(value); };
  const std::array<double, 10> scalars{tip_displacement(), tip_velocity(),   tip_acceleration(), now_.integral,
                                       now_.integral_2,    kinetic_energy(), strain_energy(),    dissipated_energy(),
                                       load_potential(),   tip_rotation()};
  return std::all_of(u.begin(), u.end(), finite) && std::all_of(theta.begin(), theta.end(), finite) &&
         std::all_of(scalars.begin(), scalars.end(), finite);
}

/// Puts the state back.
class Beam::Trial {
 public:
  explicit Trial(Beam& beam) : beam_(beam), hat_(beam.hat_) { beam_.save(state_); }
  Trial(const Trial&) = delete;
  Trial& operator=(const Trial&) = delete;
  ~Trial() {
    beam_.hat_ = hat_;
    beam_.restore(state_);
  }
  /// At rest, under nothing.
  void clear() {
    beam_.hat_ = 0.0;
    beam_.restore(std::vector<double>(state_.size(), 0.0));
  }

 private:
  Beam& beam_;
  double hat_;
  std::vector<double> state_;
};

Beam::Forecast Beam::forecast(double size) {
  const Trial trial(*this);
  const double u = tip_displacement(), v = tip_velocity();
  for (int i = 0; i < 2; ++i) step(size, {}, now_.distributed_load);
  return {(tip_displacement() - u) / (2.0 * size), (tip_velocity() - v) / (2.0 * size)};
}

Beam::Forecast Beam::forecast_per_load(double size) {
  Trial trial(*this);
  trial.clear();
  observe(0.0, 1.0);
  return forecast(size);
}

std::array<double, 2> Beam::tip_response(double size) {
  Trial trial(*this);
  trial.clear();
  std::array<double, 2> response{};
  step(size, {1.0, 0.0, 0.0}, 0.0);
  response[0] = tip_displacement();
  step(size, {}, 0.0);
  response[1] = tip_displacement();
  return response;
}

void Beam::save(std::vector<double>& state) const {
  now_.dissipated = dissipated_energy();
  state.resize(motion_size_ + sizeof now_ / sizeof(double));
  save_motion(state.data());
  double* rest = state.data() + motion_size_;
  for (const double value : {now_.integral, now_.integral_2, now_.dissipated, now_.tip_force, now_.distributed_load}) {
    *rest++ = value;
  }
}

void Beam::require_state(const std::vector<double>& state) const {
  const std::size_t size = motion_size_ + sizeof now_ / sizeof(double);
  if (state.size() != size) {
    throw std::invalid_argument("beam: a saved state of " + std::to_string(state.size()) +
                                " numbers does not belong to this beam, whose states have " + std::to_string(size));
  }
  for (const double value : state) require_finite("a number of the saved state", value);
}

void Beam::restore(const std::vector<double>& state) {
  restore_motion(state.data());
  const double* rest = state.data() + motion_size_;
  now_ = {rest[0], rest[1], rest[2], rest[3], rest[4]};
}

}  // namespace beam
