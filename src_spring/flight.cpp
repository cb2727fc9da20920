#include "flight.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace spring {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

// The tolerances hold for a step, IDA's are per internal step: what is asked of IDA is a tenth, and less where the
// step spans more of the spring's motion and so more internal steps.
constexpr double safety = 0.03, safety_per_rate = 10.0;
// IDA's local error must stay this much above rounding in the contact force, or its error estimate is noise.
constexpr double noise_margin = 20.0;
// Taylor terms are used while H × (rate of the spring) is below this; beyond, they would only cancel.
constexpr double resolved_limit = 3.0;
// No tolerance is finer than this: relative to y and z (a fraction of their rounding), and absolute.
constexpr double finest = 0.01 * epsilon, smallest = 1e-150;
// H / first step = 2ᵏ, so that it does not vary with the forces but in rare jumps. IDA doubles step and order until
// order 5; k = 3 brings it to order 3 at least.
constexpr int least_halvings = 3, most_halvings = 48;

enum Unknown { q, p, A, B, e, unknowns };

// Something in contact with the top may hold it past the hilltop, but hardly so many times as far from 0: there the
// spring pushes as hard as 1e12 linear springs would pull.
constexpr double runaway = 1e6;

}  // namespace

Flight::Flight(const Motion& motion, const Laws& laws)
    : motion_(motion),
      laws_(laws),
      hilltop_(add_events(crossings_, std::isfinite(laws.hilltop), {Crossing::falling})),
      stop_(add_events(crossings_, laws.stop, {Crossing::falling, Crossing::rising})),
      contact_(add_events(crossings_, laws.compliance, {Crossing::falling, Crossing::rising})),
      solver_(unknowns, crossings_) {}

void Flight::prepare(const FlightStart& start) {
  start_ = start;
  const double H = start.size, y = start.y, z = start.z;
  const Compliance& contact = motion_.compliance();

  auto d = motion_.derivatives(y, z, start.loads, false, 0.0);
  touching_ = false;
  Compliance::Depth depth{};
  if (laws_.compliance) {
    const auto depths = [&] {
      const auto& u = start.loads.tip;
      return Compliance::Depth{start.depth, z - u[1], d[2] - u[2], d[3], d[4]};
    };
    touching_ = Watch::direction(depths()) > 0.0;
    contact_sign_ = touching_ ? 1.0 : -1.0;
    if (touching_) d = motion_.derivatives(y, z, start.loads, true, start.depth);
    depth = depths();
    auto distance = depth;
    for (double& value : distance) value *= contact_sign_;
    contact_watch_ = Watch(distance);
  }
  if (start.released) d[2] = 0.0;
  if (laws_.stop) stop_watch_ = Watch({start.gap, z, d[2], d[3], d[4]});

  const double travel = std::abs(z) * H + std::abs(d[2]) * H * H / 2;
  const double depth_travel = std::abs(depth[1]) * H + std::abs(depth[2]) * H * H / 2;
  const double deepest = start.depth + depth_travel;
  const double force = touching_ ? contact.force(start.depth, depth[1]) : 0.0;
  const double rate =
      motion_.rate(std::abs(y) + travel, touching_ ? contact.slopes(deepest, depth[1]) : Compliance::Slopes{});
  const bool resolved = H * rate <= resolved_limit;
  const bool smooth = !touching_ || contact.analytic() || start.depth > 2.0 * depth_travel;
  const int order = !resolved ? 0 : smooth ? 4 : 2;
  R_ = Taylor({d[0], d[1], d[2], d[3], d[4]}, order);

  remainder_ = motion_.remainder(R_, start.loads);
  contact_taylor_ = dissipation_taylor_ = {};
  held_ = touching_ || start.loads.held;
  height_ = held_ ? runaway * laws_.hilltop : laws_.hilltop;
  if (touching_ && order >= 2) {
    const auto c = contact.rates(depth);
    const auto lost = contact.dissipation(depth);
    for (std::size_t k = 0; k <= static_cast<std::size_t>(order - 2); ++k) {
      contact_taylor_[k] = c[k];
      dissipation_taylor_[k] = lost[k];
    }
  }

  // Tolerances: of y and z by what they and their change over the step (or over 1/rate) are, then scaled.
  const double span = std::min(H, 1.0 / std::max(rate, std::numeric_limits<double>::min()));
  const double noise = noise_margin * epsilon * force / motion_.mass() * span;
  const double velocity = std::abs(z) + std::abs(d[2]) * span;
  const double displacement = std::abs(y) + velocity * span;
  const double share = safety / (1.0 + safety_per_rate * std::min(H * rate, resolved_limit));
  const auto tolerance_of = [&](double size, double least) {
    return std::max({share * (laws_.relative_tolerance * size + laws_.absolute_tolerance), finest * size, least});
  };
  const double tolerance_z = tolerance_of(velocity, std::max(noise, smallest));
  const double tolerance_y = tolerance_of(displacement, std::max(noise * span, smallest));
  relative_ = std::max(share * laws_.relative_tolerance, 50.0 * epsilon);
  double* tolerance = solver_.absolute_tolerance();
  tolerance[q] = tolerance[A] = tolerance[B] = tolerance_y;
  tolerance[p] = H * tolerance_z;
  const double lost = touching_ ? contact.continued(start.depth, depth[1]).dissipation : 0.0;
  tolerance[e] =
      motion_.mass() * (velocity + tolerance_z) * tolerance_z + noise_margin * epsilon * span * std::abs(lost);

  // First step: the error of the low orders that IDA begins with, from the first derivative that R leaves out.
  double h = H;
  const auto limit = [&h](double bound, double exponent) {
    if (bound < std::numeric_limits<double>::max()) h = std::min(h, std::pow(bound, exponent));
  };
  if (order == 4) {
    const double neglected = std::abs(d[5]) + rate * rate * H * std::abs(d[4]);
    limit(tolerance_z / (400.0 * neglected), 0.25);
  } else {
    limit(tolerance_z / std::abs(d[3]), 0.5);
    if (order == 0) limit(tolerance_y / std::abs(d[2]), 0.5);
  }
  const double levels = std::ceil(std::log2(H / h));
  if (std::isnan(levels)) throw IdaError("values leave the range of floating-point numbers");
  int halvings = static_cast<int>(std::clamp(levels, double{least_halvings}, double{most_halvings}));
  if (touching_ && order < Taylor::max_order) {
    // The power law has no second derivative or outgrows its rates at the start: the velocity from its growth instead.
    const auto growth = [&](double t) {
      const double deeper = start.depth + t * (std::abs(depth[1]) + t * std::abs(depth[2]) / 2);
      return t * (contact.force(deeper, depth[1]) - force) / motion_.mass();
    };
    while (halvings < most_halvings && growth(std::ldexp(H, -halvings)) > tolerance_z) ++halvings;
  }
  h0_ = std::ldexp(1.0, -halvings);

  double* Y = solver_.initial_value();
  double* Yp = solver_.initial_derivative();
  std::fill(Y, Y + unknowns, 0.0);
  std::fill(Yp, Yp + unknowns, 0.0);
  Y[p] = Yp[q] = H * (z - R_.rate(0.0));
  Yp[p] = H * H * (order == 0 ? d[2] : 0.0);
  if (order == 0) Yp[e] = H * (motion_.damping() * z * z + contact.dissipation(depth)[0]);
}

Flight::Event Flight::run(const FlightStart& start) {
  prepare(start);
  solver_.start(*this, relative_, h0_, start.most_steps);
  Event event = Event::none;
  while (event == Event::none && solver_.advance() == IdaSolver::Outcome::event) {
    if (hilltop_ >= 0 && solver_.occurred(hilltop_)) {
      finish();
      if (escapes()) return Event::hilltop;
    }
    if (stop_ >= 0 && solver_.fell(stop_))
      event = Event::stop;
    else if (contact_ >= 0 && solver_.fell(contact_))
      event = Event::contact;
  }
  finish();
  if (event == Event::none && laws_.to(height_, y_) < 0.0 && escapes()) event = Event::hilltop;
  if (event == Event::none && laws_.stop && start.gap + (y_ - start.y) < -solver_.absolute_tolerance()[q])
    throw IdaError("the top passed the stop unnoticed");
  return event;
}

/// Past the hilltop the spring pushes outwards: a top that moves outwards comes back only if something else pulls.
bool Flight::escapes() const {
  const double outwards = y_ < 0.0 ? -1.0 : 1.0;
  const double force = value(start_.loads.force, elapsed());
  return held_ || (outwards * z_ > 0.0 && motion_.push_outwards(y_, outwards, force) >= 0.0);
}

double Flight::elapsed() const { return solver_.s() * start_.size; }

void Flight::finish() {
  const double H = start_.size, t = elapsed();
  const double* Y = solver_.value();
  const double rise = R_.rise(t) + Y[q];
  y_ = start_.y + rise;
  z_ = R_.rate(t) + Y[p] / H;
  integral_ = R_.integral(t) + H * Y[A];
  integral_2_ = R_.integral_2(t) + H * H * Y[B];
  dissipated_ = motion_.damping() * R_.squared_rate_integral(t) + spring::integral(dissipation_taylor_, t) + Y[e];
}

double Flight::remainder(double t) const {
  double sum = 0.0;
  for (std::size_t k = remainder_.size(); k-- > 0;) sum = sum * t + remainder_[k];
  return sum;
}

double Flight::contact_depth(double rise, double t) const {
  const auto& u = start_.loads.tip;
  return start_.depth + rise - t * (u[1] + t * u[2] / 2);
}

bool Flight::residual(double s, const double* Y, const double* Yp, double* F) const noexcept {
  const double H = start_.size, t = H * s;
  const double w = Y[p] / H, z = R_.rate(t) + w;
  Compliance::Effect contact{};  // in excess of the Taylor terms
  if (touching_) {
    contact = motion_.compliance().continued(contact_depth(R_.rise(t) + Y[q], t), contact_rate(z, t));
    contact.force -= spring::value(contact_taylor_, t);
    contact.dissipation -= spring::value(dissipation_taylor_, t);
  }
  F[q] = Yp[q] - Y[p];
  F[p] = Yp[p] - H * H * motion_.excess_acceleration(R_(t), Y[q], w, remainder(t), contact.force);
  F[A] = Yp[A] - Y[q];
  F[B] = Yp[B] - Y[A];
  F[e] = Yp[e] - H * (motion_.damping() * w * (R_.rate(t) + z) + contact.dissipation);
  return std::isfinite(F[p]) && std::isfinite(F[e]);
}

void Flight::jacobian(double s, double c, const double* Y, const double*, double* J) const noexcept {
  const double H = start_.size, t = H * s;
  const double rise = R_.rise(t) + Y[q], z = R_.rate(t) + Y[p] / H;
  Compliance::Slopes contact{};
  if (touching_) contact = motion_.compliance().slopes(contact_depth(rise, t), contact_rate(z, t));
  const auto at = [J](int row, int column) -> double& { return J[column * unknowns + row]; };
  for (int i = 0; i < unknowns; ++i) at(i, i) = c;
  at(q, p) = -1.0;
  at(p, q) = -H * H * motion_.acceleration_by_displacement(start_.y + rise, contact.force_by_depth);
  at(p, p) = c - H * motion_.acceleration_by_velocity(contact.force_by_rate);
  at(A, q) = -1.0;
  at(B, A) = -1.0;
  at(e, q) = -H * contact.dissipation_by_depth;
  at(e, p) = -2.0 * motion_.damping() * z - contact.dissipation_by_rate;
}

void Flight::events(double s, const double* Y, double* g) const noexcept {
  const double H = start_.size, t = H * s;
  const double rise = R_.rise(t) + Y[q], z = R_.rate(t) + Y[p] / H;
  if (hilltop_ >= 0) g[hilltop_] = laws_.to(height_, start_.y + rise);
  if (stop_ >= 0) {
    g[stop_] = stop_watch_.distance(start_.gap + rise, t);
    g[stop_ + 1] = stop_watch_.rate(z, t);
  }
  if (contact_ >= 0) {
    g[contact_] = contact_watch_.distance(contact_sign_ * contact_depth(rise, t), t);
    g[contact_ + 1] = contact_watch_.rate(contact_sign_ * contact_rate(z, t), t);
  }
}

}  // namespace spring
