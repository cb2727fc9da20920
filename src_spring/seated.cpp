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

Seated::Seated(const Motion& motion, const Laws& laws)
    : motion_(motion),
      laws_(laws),
      release_(add_events(crossings_, true, {Crossing::falling, Crossing::rising})),
      contact_(add_events(crossings_, laws.compliance, {Crossing::falling, Crossing::rising})),
      solver_(unknowns, crossings_) {}

bool Seated::holds(const Quadratic& holding_force) {
  return Watch::direction({holding_force[0], holding_force[1], holding_force[2] / 2}) >= 0.0;
}

double Seated::contact_depth(double displacement, double t) const {
  const auto& u = start_.loads.tip;
  return start_.depth + displacement - t * (u[1] + t * u[2] / 2);
}

void Seated::prepare(const SeatedStart& start) {
  start_ = start;
  const double H = start.size, y = laws_.stop_position;
  const Compliance& contact = motion_.compliance();
  const auto& u = start.loads.tip;

  const Series depth{start.depth, -u[1], -u[2] / 2};  // over τ
  touching_ = laws_.compliance && Watch::direction(depth) > 0.0;
  contact_sign_ = touching_ ? 1.0 : -1.0;
  auto distance = depth;
  for (double& value : distance) value *= contact_sign_;
  contact_watch_ = Watch(distance);

  auto N = motion_.holding_force(y, start.loads, touching_, start.depth);
  const double depth_travel = std::abs(u[1]) * H + std::abs(u[2]) * H * H / 2;
  const bool smooth = !touching_ || contact.analytic() || start.depth > 2.0 * depth_travel;
  if (!smooth) N[2] = 0.0;  // may be infinite
  release_watch_ = Watch({N[0], N[1], N[2] / 2});
  N_ = N;

  const double force = touching_ ? contact.force(start.depth, depth[1]) : 0.0;
  const double deepest = touching_ ? contact.force(start.depth + depth_travel, depth[1]) : 0.0;
  const double scale =
      motion_.mass() * motion_.acceleration_scale(y, 0.0, start.loads.force[0], force) + std::abs(deepest - force);
  const double tolerance_N =
      std::max(safety * (laws_.relative_tolerance * scale + laws_.absolute_tolerance), noise_margin * epsilon * scale);
  relative_ = std::max(safety * laws_.relative_tolerance, 50.0 * epsilon);
  double* tolerance = solver_.absolute_tolerance();
  tolerance[eta] = tolerance[zeta] = safety * laws_.absolute_tolerance;
  tolerance[n] = tolerance_N;
  tolerance[P] = H * tolerance_N;
  tolerance[e] = (depth_travel + laws_.absolute_tolerance) * tolerance_N;

  // First step: N − N_R starts flat and must still be within the tolerance after it.
  int halvings = least_halvings;
  const double slope = touching_ ? contact.slopes(start.depth, depth[1]).force_by_depth : 0.0;
  const auto growth = [&](double t) {
    const double deeper = t * (std::abs(u[1]) + t * std::abs(u[2]) / 2);
    return std::abs(contact.force(start.depth + deeper, depth[1]) - force - slope * deeper);
  };
  if (touching_) {
    while (halvings < most_halvings && growth(std::ldexp(H, -halvings)) > tolerance_N) ++halvings;
  }
  h0_ = std::ldexp(1.0, -halvings);

  double* Y = solver_.initial_value();
  double* Yp = solver_.initial_derivative();
  std::fill(Y, Y + unknowns, 0.0);
  std::fill(Yp, Yp + unknowns, 0.0);
  if (touching_) Yp[e] = H * contact.continued(start.depth, depth[1]).dissipation;
}

Seated::Event Seated::run(const SeatedStart& start) {
  prepare(start);
  solver_.start(*this, relative_, h0_, start.most_steps);
  Event event = Event::none;
  while (event == Event::none && solver_.advance() == IdaSolver::Outcome::event) {
    if (solver_.fell(release_))
      event = Event::release;
    else if (contact_ >= 0 && solver_.fell(contact_))
      event = Event::contact;
  }
  impulse_ = spring::integral(N_, elapsed()) + start.size * solver_.value()[P];
  dissipated_ = solver_.value()[e];
  return event;
}

double Seated::elapsed() const { return solver_.s() * start_.size; }

bool Seated::residual(double s, const double* Y, const double* Yp, double* F) const noexcept {
  const double t = s * start_.size, y = laws_.stop_position + Y[eta];
  Compliance::Effect contact{};
  if (touching_) contact = motion_.compliance().continued(contact_depth(Y[eta], t), contact_rate(Y[zeta], t));
  const double outer = spring::value(start_.loads.force, t);
  F[eta] = Y[eta];
  F[zeta] = Y[zeta];
  F[n] = spring::value(N_, t) + Y[n] + motion_.mass() * motion_.acceleration(y, Y[zeta], outer, contact.force);
  F[P] = Yp[P] - Y[n];
  F[e] = Yp[e] - start_.size * contact.dissipation;
  return std::isfinite(F[n]) && std::isfinite(F[e]);
}

void Seated::jacobian(double s, double c, const double* Y, const double*, double* J) const noexcept {
  const double t = s * start_.size, y = laws_.stop_position + Y[eta];
  Compliance::Slopes contact{};
  if (touching_) contact = motion_.compliance().slopes(contact_depth(Y[eta], t), contact_rate(Y[zeta], t));
  const auto at = [J](int row, int column) -> double& { return J[column * unknowns + row]; };
  at(eta, eta) = 1.0;
  at(zeta, zeta) = 1.0;
  at(n, eta) = motion_.mass() * motion_.acceleration_by_displacement(y, contact.force_by_depth);
  at(n, zeta) = motion_.mass() * motion_.acceleration_by_velocity(contact.force_by_rate);
  at(n, n) = 1.0;
  at(P, n) = -1.0;
  at(P, P) = c;
  at(e, eta) = -start_.size * contact.dissipation_by_depth;
  at(e, zeta) = -start_.size * contact.dissipation_by_rate;
  at(e, e) = c;
}

void Seated::events(double s, const double* Y, double* g) const noexcept {
  const double t = s * start_.size;
  const auto& u = start_.loads.tip;
  const double depth = contact_depth(Y[eta], t), rate = -spring::rate(u, t);
  double force_rate = -spring::rate(start_.loads.force, t);
  if (touching_) {
    const auto contact = motion_.compliance().slopes(depth, rate);
    force_rate += contact.force_by_depth * rate - contact.force_by_rate * u[2];
  }
  g[release_] = release_watch_.distance(spring::value(N_, t) + Y[n], t);
  g[release_ + 1] = release_watch_.rate(force_rate, t);
  if (contact_ >= 0) {
    g[contact_] = contact_watch_.distance(contact_sign_ * depth, t);
    g[contact_ + 1] = contact_watch_.rate(contact_sign_ * rate, t);
  }
}

}  // namespace spring
