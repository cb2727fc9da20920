#include "beam.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "generalized_alpha.hpp"
#include "integrator.hpp"
#include "modal_beam.hpp"
#include "validate.hpp"

namespace beam {

void throw_not_finite(double size, const TipForce& c, double distributed_load) {
  std::ostringstream message;
  message.precision(17);
  message << "beam: the result is not finite after a step of " << size << " s under the tip force " << c[0] << " N, "
          << c[1] << " N/s, " << c[2] << " N/s2 and the load " << distributed_load
          << " N/m; the state is unchanged, use a smaller step or smaller inputs";
  throw std::domain_error(message.str());
}

bool outputs_finite(const BeamIntegrator& beam) {
  std::array<double, shape_points> u{}, theta{};
  beam.deflection(u);
  beam.rotation(theta);
  const auto finite = [](double value) { return std::isfinite(value); };
  const std::array<double, 10> scalars{beam.tip_displacement(),
                                       beam.tip_velocity(),
                                       beam.tip_acceleration(),
                                       beam.tip_displacement_integral(),
                                       beam.tip_displacement_integral_2(),
                                       beam.kinetic_energy(),
                                       beam.strain_energy(),
                                       beam.dissipated_energy(),
                                       beam.load_potential(),
                                       beam.tip_rotation()};
  return std::all_of(u.begin(), u.end(), finite) && std::all_of(theta.begin(), theta.end(), finite) &&
         std::all_of(scalars.begin(), scalars.end(), finite);
}

namespace {

/// Puts the state back.
class Trial {
 public:
  explicit Trial(BeamIntegrator& beam) : beam_(beam) { beam_.save(state_); }
  Trial(const Trial&) = delete;
  Trial& operator=(const Trial&) = delete;
  ~Trial() { beam_.restore(state_); }

 private:
  BeamIntegrator& beam_;
  std::vector<double> state_;
};

}  // namespace

struct Beam::Impl {
  std::unique_ptr<BeamIntegrator> integrator;
  std::size_t state_size;
};

Beam::Beam(const Parameters& parameters) {
  validate(parameters);
  auto integrator = parameters.integrator == Integrator::modal ? make_modal_beam(parameters)
                                                               : make_generalized_alpha_beam(parameters);
  std::vector<double> state;
  integrator->save(state);
  impl_ = std::make_unique<Impl>(Impl{std::move(integrator), state.size()});
}

Beam::~Beam() = default;
Beam::Beam(Beam&&) noexcept = default;
Beam& Beam::operator=(Beam&&) noexcept = default;

void Beam::step(double size, const std::array<double, 3>& tip_force, double distributed_load) {
  require_step_size(size);
  for (const double c : tip_force) require_finite("tip_force and its derivatives", c);
  require_finite("distributed_load [N/m]", distributed_load);
  impl_->integrator->step(size, tip_force, distributed_load);
}

void Beam::apply_tip_impulse(double impulse) {
  require_finite("tip_impulse [N.s]", impulse);
  impl_->integrator->apply_tip_impulse(impulse);
}

void Beam::set_distributed_load(double distributed_load) {
  require_finite("distributed_load [N/m]", distributed_load);
  impl_->integrator->set_distributed_load(distributed_load);
}

double Beam::tip_displacement() const { return impl_->integrator->tip_displacement(); }
double Beam::tip_velocity() const { return impl_->integrator->tip_velocity(); }
double Beam::tip_acceleration() const { return impl_->integrator->tip_acceleration(); }
double Beam::tip_rotation() const { return impl_->integrator->tip_rotation(); }
double Beam::tip_displacement_integral() const { return impl_->integrator->tip_displacement_integral(); }
double Beam::tip_displacement_integral_2() const { return impl_->integrator->tip_displacement_integral_2(); }
double Beam::kinetic_energy() const { return impl_->integrator->kinetic_energy(); }
double Beam::strain_energy() const { return impl_->integrator->strain_energy(); }
double Beam::dissipated_energy() const { return impl_->integrator->dissipated_energy(); }
double Beam::load_potential() const { return impl_->integrator->load_potential(); }
double Beam::tip_mass() const { return impl_->integrator->tip_mass(); }
double Beam::static_tip_compliance() const { return impl_->integrator->static_tip_compliance(); }
void Beam::deflection(std::array<double, shape_points>& u) const { impl_->integrator->deflection(u); }
void Beam::rotation(std::array<double, shape_points>& theta) const { impl_->integrator->rotation(theta); }

Beam::Forecast Beam::forecast(double size, double distributed_load) {
  const Trial trial(*impl_->integrator);
  const double u = tip_displacement(), v = tip_velocity();
  for (int i = 0; i < 2; ++i) step(size, {}, distributed_load);
  return {(tip_displacement() - u) / (2.0 * size), (tip_velocity() - v) / (2.0 * size)};
}

std::array<double, 2> Beam::tip_response(double size) {
  const Trial trial(*impl_->integrator);
  const std::vector<double> rest(impl_->state_size, 0.0);
  std::array<double, 2> response{};
  for (const double force : {1.0, 0.0}) {  // the difference: other loads act in both
    impl_->integrator->restore(rest);
    for (std::size_t i = 0; i < 2; ++i) {
      step(size, {i == 0 ? force : 0.0, 0.0, 0.0}, 0.0);
      response[i] = force == 0.0 ? response[i] - tip_displacement() : tip_displacement();
    }
  }
  return response;
}

std::vector<double> Beam::frequencies() const { return impl_->integrator->frequencies(); }

void Beam::save(std::vector<double>& state) const { impl_->integrator->save(state); }

void Beam::restore(const std::vector<double>& state) {
  if (state.size() != impl_->state_size) {
    throw std::invalid_argument("beam: a saved state of " + std::to_string(state.size()) +
                                " numbers does not belong to this beam, whose states have " +
                                std::to_string(impl_->state_size));
  }
  // A sum is finite only if its terms are, and found at once.
  const Eigen::Map<const Eigen::VectorXd> numbers(state.data(), static_cast<Eigen::Index>(state.size()));
  if (!std::isfinite(numbers.sum())) {
    for (const double value : state) require_finite("a number of the saved state", value);
  }
  impl_->integrator->restore(state);
}

}  // namespace beam
