#include "beam.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "gauss.hpp"
#include "midpoint.hpp"
#include "modal_beam.hpp"
#include "timoshenko.hpp"

namespace beam {

using Eigen::VectorXd;

namespace {

/// While coefficients stay below `largest_coefficient`, inputs below `largest_input`, the state's norm below `largest`
/// and step sizes [s] below `largest_size`, no output can overflow. What is not is refused.
constexpr double largest_coefficient = 1e40, largest_input = 1e120, largest = 1e60, largest_size = 1e10;
/// A frequency is known to rounding: of a larger phase [rad] fewer than 4 digits would be left.
constexpr double largest_phase = 1e12;

[[noreturn]] void reject(const char* name, double value, const std::string& allowed) {
  throw std::invalid_argument(std::string("beam: ") + name + " = " + number(value) + " is not allowed; it must be " +
                              allowed);
}

/// @throws std::invalid_argument for the first parameter that is not allowed beside the others
void validate(const Parameters& p) {
  const int most_elements = 2 * max_elements / (p.element_degree * (p.element_degree + 1));
  if (p.n_elements > most_elements) {
    reject("n_elements", p.n_elements,
           "between 1 and " + std::to_string(most_elements) +
               " with element_degree = " + std::to_string(p.element_degree));
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
               std::to_string(max_dense_unknowns) + " unknowns); keep fewer n_modes, or use the integrator midpoint");
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
  throw std::overflow_error(message + "; the state is unchanged, use smaller inputs");
}

/// Those that a load of 1 N/m, 1 N or 1 m/s² (Loads::Shape) asks for: Q = ∫f ds, M = ∫(s − x) f ds over x … L. A point
/// force at x itself counts.
InternalForces internal_forces(const Parameters& p, std::size_t shape) {
  InternalForces forces;
  for (Eigen::Index j = 0; j < shape_points; ++j) {
    const double x = static_cast<double>(j) / (shape_points - 1);
    const auto add = [&](double place, double force) {
      forces.shear[j] += force;
      forces.moment[j] += p.length * (place - x) * force;
    };
    if (Loads::is_point(shape)) {
      if (point_force_place(p, shape) >= x) add(point_force_place(p, shape), 1.0);
      continue;
    }
    const double from = shape == Loads::hat ? std::max(x, 1.0 - 1.0 / p.n_elements) : x;  // where f has no kink
    at_gauss_points([&](double part, double weight) {
      const double place = from + part * (1.0 - from);
      add(place, (1.0 - from) * p.length * weight * load_density(p, shape, place));
    });
  }
  return forces;
}

}  // namespace

bool Loads::is_point(std::size_t shape) { return shape >= point && shape <= tip; }

double load_density(const Parameters& p, std::size_t shape, double place) {
  if (shape == Loads::hat) return std::max(0.0, 1.0 - (1.0 - place) * p.n_elements);
  if (shape == Loads::base_acceleration) return -p.density * p.area;
  return std::pow(place, static_cast<double>(shape));
}

double point_force_place(const Parameters& p, std::size_t shape) {
  return shape == Loads::tip ? 1.0 : p.point_force_position[shape - Loads::point];
}

std::unique_ptr<Beam> make_beam(const Parameters& parameters) {
  validate(parameters);
  auto mesh = std::make_unique<const Timoshenko>(parameters);
  return parameters.integrator == Integrator::modal ? make_modal_beam(*mesh, parameters)
                                                    : make_midpoint_beam(std::move(mesh), parameters);
}

Beam::Beam(std::unique_ptr<const Discretisation> space, const Parameters& p)
    : alpha_b_(p.alpha_b),
      struck_(space->mass_solve(space->load(Loads::tip))),
      now_{p.initial_deflection_slope * space->linear_shape(), p.initial_velocity_slope * space->linear_shape(), {}},
      start_(now_),
      longest_step_(largest_size),
      space_(std::move(space)) {
  for (std::size_t i = 0; i < Loads::count; ++i) {
    const InternalForces forces = internal_forces(p, i);
    shear_.col(static_cast<Eigen::Index>(i)) = forces.shear;
    moment_.col(static_cast<Eigen::Index>(i)) = forces.moment;
  }
}

void Beam::limit_phase(double fastest) {
  longest_step_ = largest_phase / std::max(fastest, largest_phase / largest_size);
}

void Beam::require_coefficients(std::initializer_list<double> values) {
  for (const double value : values) {
    if (!(value < largest_coefficient)) throw std::invalid_argument("beam: the parameters leave the range of numbers");
  }
}

void Beam::step(double size, const Polynomial& c, const Loads& loads) {
  if (!(size <= longest_step_)) {
    throw std::domain_error("beam: a step of " + number(size) + " s is too long: take at most " +
                            number(longest_step_) + " s, in which no mode turns by more than " + number(largest_phase) +
                            " rad");
  }
  bool small = true;
  const auto check = [&small](const Polynomial& f) {
    for (const double value : f) small = small && std::abs(value) < largest_input;
  };
  check(c);
  loads.for_each([&check](std::size_t, const Polynomial& f) { check(f); });
  if (!small) throw_too_large(size, c, loads);
  try {
    move(size, c, loads);
  } catch (const std::domain_error&) {
    restore(start_);
    throw;
  }
  // By the largest one first, as squares may overflow; of their sum, as that is what NaN shows in.
  const auto in_range = [](const VectorXd& x) {
    return x.lpNorm<Eigen::Infinity>() < largest && x.squaredNorm() < largest * largest;
  };
  if (in_range(now_.q) && in_range(now_.v)) return;
  restore(start_);
  throw_too_large(size, c, loads);
}

void Beam::move(double size, const Polynomial& c, const Loads& loads) {
  book();
  std::swap(now_, start_);
  now_.scalars = start_.scalars;
  advance(size, c, loads);
  booked_ = false;
  now_.scalars.tip_force = value(c, size);
  now_.scalars.loads = loads.at(size);
}

void Beam::book() const {
  if (!booked_) book_step();
  booked_ = true;
}

void Beam::apply_tip_impulse(double impulse) {
  if (!(std::abs(impulse) < largest_input)) throw_too_large(0.0, {impulse, 0.0, 0.0}, {});
  book();
  now_.v += impulse * struck_;
}

void Beam::set_forces(double tip_force, const Loads& loads) {
  now_.scalars.tip_force = tip_force;
  now_.scalars.loads = loads.at(0.0);
}

void Beam::put_at_rest() {
  book();
  now_.q = space_->flexibility_times(force(now_.scalars.loads, now_.scalars.tip_force));
  now_.v.setZero();
}

VectorXd Beam::force(Loads::Values loads, double tip_force) const {
  // In the order of a modal step: what is at rest stays there to the last digit.
  VectorXd sum = tip_force * space_->load(Loads::tip);
  for (std::size_t i = 0; i < Loads::count; ++i) {
    if (loads[i] != 0.0) sum += loads[i] * space_->load(i);
  }
  return sum;
}

VectorXd Beam::inertia_force() const {
  return force(now_.scalars.loads, now_.scalars.tip_force) - space_->stiffness_times(now_.q + alpha_b_ * now_.v);
}

double Beam::potential(const Loads::Values& loads, const VectorXd& x) const {
  return -loads[Loads::distributed] * space_->load(Loads::distributed).dot(x) -
         loads[Loads::hat] * space_->load(Loads::hat).dot(x);
}

double Beam::load_potential_rate(const Loads::Values& loads_rate) const {
  return potential(now_.scalars.loads, now_.v) + potential(loads_rate, now_.q);
}

Beam::Response Beam::respond(const VectorXd& acceleration, Loads::Values loads, double tip_force) const {
  loads[Loads::tip] += tip_force;
  const Eigen::Map<const Eigen::Matrix<double, Loads::count, 1>> values(loads.data());
  const InternalForces inertia = space_->inertia(acceleration);
  return {space_->tip(acceleration), {shear_ * values - inertia.shear, moment_ * values - inertia.moment}};
}

Beam::Response Beam::response() const { return respond(acceleration(), now_.scalars.loads, now_.scalars.tip_force); }

Beam::Response Beam::response_rate(const Loads::Values& loads, double tip_force) const {
  const VectorXd rate = force(loads, tip_force) - space_->stiffness_times(now_.v + alpha_b_ * acceleration());
  return respond(space_->mass_solve(rate), loads, tip_force);
}

/// Puts the state back.
class Beam::Trial {
 public:
  explicit Trial(Beam& beam) : beam_(beam), state_(beam.state()) {}
  Trial(const Trial&) = delete;
  Trial& operator=(const Trial&) = delete;
  ~Trial() { beam_.restore(state_); }

 private:
  Beam& beam_;
  State state_;
};

double Beam::forecast(double size) {
  const Trial trial(*this);
  const double u = tip_displacement();
  Loads loads;
  for (std::size_t i = 0; i < Loads::count; ++i) loads.set(i, {now_.scalars.loads[i], 0.0, 0.0});
  for (int i = 0; i < 2; ++i) move(size, {}, loads);
  return (tip_displacement() - u) / (2.0 * size);
}

double Beam::forecast_rate(double size, const Loads::Values& loads_rate) {
  const Trial trial(*this);
  VectorXd rate = acceleration();
  now_.q.swap(now_.v);
  now_.v.swap(rate);
  now_.scalars.loads = loads_rate;
  return forecast(size);
}

Beam::TipResponse Beam::tip_response(double size) {
  const Trial trial(*this);
  restore({VectorXd::Zero(now_.q.size()), VectorXd::Zero(now_.v.size()), {}});  // at rest, under nothing
  TipResponse response{};
  for (const std::size_t i : {0U, 1U}) {
    step(size, {i == 0 ? 1.0 : 0.0, 0.0, 0.0}, {});
    response[i] = tip_displacement();
  }
  return response;
}

void Beam::restore(const State& state) {
  now_ = state;
  booked_ = true;
}

}  // namespace beam
