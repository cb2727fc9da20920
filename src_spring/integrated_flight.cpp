#include "integrated_flight.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace spring {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

// The tolerances hold for a step, IDA's are per internal step, of which one takes hundreds.
constexpr double share = 3e-4;
// IDA refuses relative tolerances near rounding, at which it cannot tell its error.
constexpr double least_relative_tolerance = 50.0 * epsilon;
// Its local error must stay this much above rounding in the forces, or its error estimate is noise.
constexpr double noise_margin = 20.0;
// IDA divides by tolerances and squares: so small a one does not overflow.
constexpr double least_tolerance = 1e-150;
// The first step is halved until backward Euler keeps the tolerance, so that it hardly varies with the forces. More
// halvings than this come below rounding of s.
constexpr int most_halvings = 48;

enum Unknown { q, p, A, B, e, unknowns };

}  // namespace

IntegratedFlight::IntegratedFlight(const EquationOfMotion& equation, const Parameters& parameters)
    : equation_(equation), parameters_(parameters), solver_(unknowns) {}

void IntegratedFlight::run(const Start& start, bool touching, FlightEnd& end) {
  start_ = start;
  loads_ = start.loads.scaled(start.size);
  touching_ = touching;
  launch();
  while (solver_.s() < 1.0) {
    solver_.step();
    const auto [event, place] = event_of_last_step();
    if (event != Event::none) solver_.interpolate(solver_.last_start() + place * solver_.last_size());
    end = here(event);
    if (event != Event::none) return;
  }
}

FlightEnd IntegratedFlight::here(Event event) const {
  const double H = start_.size, y = start_.y, s = solver_.s();
  const double* Y = solver_.value();
  return {event, s * H,          s == 1.0, y + Y[q], Y[p] / H, H * (s * y + Y[A]), H * H * (s * s / 2 * y + Y[B]),
          Y[e],  solver_.steps()};
}

void IntegratedFlight::launch() {
  const double H = start_.size, z = start_.z;
  const Compliance& law = equation_.compliance();
  const auto contact = [&](double deep, double rate) { return touching_ ? law.continued(deep, rate).force : 0.0; };
  const double rate = depth_rate(H * z, 0.0), force = contact(start_.depth, rate), F = loads_.force[0];
  const double a = start_.released ? 0.0 : equation_.acceleration(start_.y, z, F, force);

  // What y and z are, or become over the span or the time in which the motion changes.
  const Compliance::Slopes slopes = touching_ ? law.slopes(start_.depth, rate) : Compliance::Slopes{};
  const double change = equation_.rates(std::abs(equation_.elongation(start_.y)), slopes).sum();
  const double span = H * change > 1.0 ? 1.0 / change : H;
  // What F's rates add is all that moves a top from rest where F begins at 0.
  const double mass = equation_.mass(), part = span / H;
  const double jerk = part * std::abs(loads_.force[1]) / mass, snap = part * part * std::abs(loads_.force[2]) / mass;
  const double velocity = std::abs(z) + (std::abs(a) + jerk / 2 + snap / 6) * span,
               displacement = std::abs(start_.y) + (std::abs(z) + (std::abs(a) + jerk / 6 + snap / 24) * span) * span;
  // Rounding of the forces, but that of damping, which grows no larger than that of the velocity.
  const double forces = std::abs(F) + std::abs(equation_.spring_force(start_.y)) + force;
  const double noise = noise_margin * epsilon * forces / mass * span;
  const auto tolerance = [&](double size, double least) {
    const double wanted = share * (parameters_.relative_tolerance * size + parameters_.absolute_tolerance);
    return std::max({wanted, least, least_tolerance});
  };
  const double of_z = tolerance(velocity, noise), of_y = tolerance(displacement, noise * span);
  double* tolerances = solver_.absolute_tolerance();
  tolerances[q] = tolerances[A] = tolerances[B] = of_y;
  tolerances[p] = H * of_z;
  tolerances[e] = mass * (velocity + of_z) * of_z;

  double* Y = solver_.initial_value();
  double* Yp = solver_.initial_derivative();
  std::fill(Y, Y + unknowns, 0.0);
  std::fill(Yp, Yp + unknowns, 0.0);
  Y[p] = Yp[q] = H * z;
  Yp[p] = H * H * a;
  const double lost = touching_ ? law.continued(start_.depth, rate).dissipation : 0.0;
  Yp[e] = H * (equation_.damping() * z * z + lost);

  // Errors of q and p in a step of backward Euler, along the parabola of the start.
  const auto too_long = [&](double s) {
    const double rise = s * H * (z + s * H * a / 2), later = z + s * H * a;
    const double deeper = start_.depth + std::abs(depth(rise, s) - start_.depth);
    const double then = equation_.acceleration(start_.y + rise, later, value(loads_.force, s),
                                               contact(deeper, depth_rate(H * later, s)));
    return s * s * H * H * std::abs(a) > 2.0 * of_y || s * H * std::abs(then - a) > 2.0 * of_z;
  };
  int halvings = 0;
  while (halvings < most_halvings && too_long(std::ldexp(1.0, -halvings))) ++halvings;
  const double relative = std::max(share * parameters_.relative_tolerance, least_relative_tolerance);
  solver_.start(*this, relative, std::ldexp(1.0, -halvings), start_.most_steps);
}

/// IDA's solution over an internal step is a polynomial.
Occurrence IntegratedFlight::event_of_last_step() const {
  const double from = solver_.last_start(), h = solver_.last_size();
  const auto [rise, degree] = solver_.over_last_step(q);
  Series gap = rise, depth = rise;
  gap[0] += start_.gap;
  const Polynomial tip = scaled(shifted(loads_.tip, from), h);
  depth[0] += start_.depth - (tip[0] - loads_.tip[0]);
  depth[1] -= tip[1];
  depth[2] -= tip[2] / 2;
  return first_event(parameters_, gap, depth, touching_, std::max(degree, 2));
}

double IntegratedFlight::depth(double q, double s) const {
  return start_.depth + q - s * (loads_.tip[1] + s * loads_.tip[2] / 2);
}
double IntegratedFlight::depth_rate(double p, double s) const { return (p - rate(loads_.tip, s)) / start_.size; }

bool IntegratedFlight::residual(double s, const double* Y, const double* Yp, double* F) const noexcept {
  const double H = start_.size, z = Y[p] / H;
  Compliance::Effect contact{};
  if (touching_) contact = equation_.compliance().continued(depth(Y[q], s), depth_rate(Y[p], s));
  F[q] = Yp[q] - Y[p];
  F[p] = Yp[p] - H * H * equation_.acceleration(start_.y + Y[q], z, value(loads_.force, s), contact.force);
  F[A] = Yp[A] - Y[q];
  F[B] = Yp[B] - Y[A];
  F[e] = Yp[e] - H * (equation_.damping() * z * z + contact.dissipation);
  return std::isfinite(F[p]) && std::isfinite(F[e]);
}

void IntegratedFlight::jacobian(double s, double c, const double* Y, const double*, double* J) const noexcept {
  const double H = start_.size;
  Compliance::Slopes contact{};
  if (touching_) contact = equation_.compliance().slopes(depth(Y[q], s), depth_rate(Y[p], s));
  const auto at = [J](int row, int column) -> double& { return J[column * unknowns + row]; };
  for (int i = 0; i < unknowns; ++i) at(i, i) = c;
  at(q, p) = -1.0;
  at(p, q) = -H * H * equation_.acceleration_by_displacement(start_.y + Y[q], contact.force_by_depth);
  at(p, p) = c - H * equation_.acceleration_by_velocity(contact.force_by_rate);
  at(A, q) = -1.0;
  at(B, A) = -1.0;
  at(e, q) = -H * contact.dissipation_by_depth;
  at(e, p) = -2.0 * equation_.damping() * Y[p] / H - contact.dissipation_by_rate;
}

}  // namespace spring
