#include "seated.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace spring {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr double safety = 0.01;        ///< of the tolerance, per internal step
constexpr double noise_margin = 20.0;  ///< as in flight.cpp
constexpr int least_halvings = 3, most_halvings = 48;

enum Unknown { eta, zeta, n, P, e, unknowns };

}  // namespace

Seated::Seated(const Motion& motion, const Parameters& parameters)
    : Segment(motion, parameters, unknowns, {Crossing::falling, Crossing::rising}) {}

bool Seated::holds(const Polynomial& holding_force) {
  return Watch::direction({holding_force[0], holding_force[1], holding_force[2] / 2}) >= 0.0;
}

void Seated::prepare() {
  const double H = start_.size, y = parameters_.stop_position;
  const Compliance& contact = motion_.compliance();
  const auto& u = loads_.tip;

  const Series depth{start_.depth, -u[1], -u[2] / 2};
  meet(parameters_.compliant() && Watch::direction(depth) > 0.0, depth);

  N_ = scaled(motion_.holding_force(y, start_.loads, touching_, start_.depth), H);
  const double depth_travel = std::abs(u[1]) + std::abs(u[2]) / 2, depth_rate = depth[1] / H;
  const bool smooth = !touching_ || contact.analytic() || start_.depth > 2.0 * depth_travel;
  if (!smooth) N_[2] = 0.0;  // may be infinite
  release_watch_ = Watch({N_[0], N_[1], N_[2] / 2});

  const double force = touching_ ? contact.force(start_.depth, depth_rate) : 0.0;
  const double deepest = touching_ ? contact.force(start_.depth + depth_travel, depth_rate) : 0.0;
  const double scale =
      motion_.mass() * motion_.acceleration_scale(y, 0.0, start_.loads.force[0], force) + std::abs(deepest - force);
  const double tolerance_N =
      std::max(safety * (parameters_.relative_tolerance * scale + parameters_.absolute_tolerance),
               noise_margin * epsilon * scale);
  double* tolerance = solver_.absolute_tolerance();
  tolerance[eta] = tolerance[zeta] = safety * parameters_.absolute_tolerance;
  tolerance[n] = tolerance_N;
  tolerance[P] = H * tolerance_N;
  tolerance[e] = (depth_travel + parameters_.absolute_tolerance) * tolerance_N;

  // First step: N − N_R starts flat and must still be within the tolerance after it.
  int halvings = least_halvings;
  const double slope = touching_ ? contact.slopes(start_.depth, depth_rate).force_by_depth : 0.0;
  const auto growth = [&](double s) {
    const double deeper = s * (std::abs(u[1]) + s * std::abs(u[2]) / 2);
    return std::abs(contact.force(start_.depth + deeper, depth_rate) - force - slope * deeper);
  };
  if (touching_) {
    while (halvings < most_halvings && growth(std::ldexp(1.0, -halvings)) > tolerance_N) ++halvings;
  }

  double* Y = solver_.initial_value();
  double* Yp = solver_.initial_derivative();
  std::fill(Y, Y + unknowns, 0.0);
  std::fill(Yp, Yp + unknowns, 0.0);
  if (touching_) Yp[e] = H * contact.continued(start_.depth, depth_rate).dissipation;
  const double relative = std::max(safety * parameters_.relative_tolerance, 50.0 * epsilon);
  solver_.start(*this, relative, std::ldexp(1.0, -halvings), start_.most_steps);
}

Seated::Event Seated::run(const Start& start) {
  begin(start);
  prepare();
  Event event = Event::none;
  while (event == Event::none && solver_.advance() == IdaSolver::Outcome::event) {
    if (solver_.fell(own_))
      event = Event::release;
    else if (contact_ >= 0 && solver_.fell(contact_))
      event = Event::contact;
  }
  const double H = start.size, t = elapsed(), y = parameters_.stop_position;
  const double impulse = H * (solver_.s() * mean(N_, solver_.s()) + solver_.value()[P]);
  reached_ = {y, 0.0, y * t, y * t * t / 2, solver_.value()[e], impulse};
  return event;
}

bool Seated::residual(double s, const double* Y, const double* Yp, double* F) const noexcept {
  const double H = start_.size, y = parameters_.stop_position + Y[eta];
  Compliance::Effect contact{};
  if (touching_) contact = motion_.compliance().continued(contact_depth(Y[eta], s), contact_rate(H * Y[zeta], s) / H);
  const double outer = value(loads_.force, s);
  F[eta] = Y[eta];
  F[zeta] = Y[zeta];
  F[n] = value(N_, s) + Y[n] + motion_.mass() * motion_.acceleration(y, Y[zeta], outer, contact.force);
  F[P] = Yp[P] - Y[n];
  F[e] = Yp[e] - H * contact.dissipation;
  return std::isfinite(F[n]) && std::isfinite(F[e]);
}

void Seated::jacobian(double s, double c, const double* Y, const double*, double* J) const noexcept {
  const double H = start_.size, y = parameters_.stop_position + Y[eta];
  Compliance::Slopes contact{};
  if (touching_) contact = motion_.compliance().slopes(contact_depth(Y[eta], s), contact_rate(H * Y[zeta], s) / H);
  const auto at = [J](int row, int column) -> double& { return J[column * unknowns + row]; };
  at(eta, eta) = 1.0;
  at(zeta, zeta) = 1.0;
  at(n, eta) = motion_.mass() * motion_.acceleration_by_displacement(y, contact.force_by_depth);
  at(n, zeta) = motion_.mass() * motion_.acceleration_by_velocity(contact.force_by_rate);
  at(n, n) = 1.0;
  at(P, n) = -1.0;
  at(P, P) = c;
  at(e, eta) = -H * contact.dissipation_by_depth;
  at(e, zeta) = -H * contact.dissipation_by_rate;
  at(e, e) = c;
}

void Seated::events(double s, const double* Y, double* g) const noexcept {
  const double H = start_.size, rate = contact_rate(0.0, s);
  double force_rate = -common::rate(loads_.force, s);
  if (touching_) {
    const auto contact = motion_.compliance().slopes(contact_depth(Y[eta], s), rate / H);
    force_rate += contact.force_by_depth * rate - contact.force_by_rate * loads_.tip[2] / H;
  }
  contact_events(Y[eta], 0.0, s, g);
  g[own_] = release_watch_.distance(value(N_, s) + Y[n], s);
  g[own_ + 1] = release_watch_.rate(force_rate, s);
}

}  // namespace spring
