#include "flight.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace spring {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

// The tolerances hold for a step, IDA's are per internal step: what is asked of IDA is a tenth, and less where the
// step spans more of the spring's motion and so more internal steps.
constexpr double safety = 0.01, safety_per_rate = 10.0;
// IDA's local error must stay this much above rounding in the contact force, or its error estimate is noise.
constexpr double noise_margin = 20.0;
// Taylor terms are used while H × (rate of the spring) is below this; beyond, they would only cancel.
constexpr double resolved_limit = 3.0;
// No tolerance is finer than this: relative to y and z (a fraction of their rounding), and absolute.
constexpr double finest = 0.01 * epsilon, smallest = 1e-150;
// H / first step = 2ᵏ, so that it does not vary with the forces but in rare jumps. IDA doubles step and order until
// order 5; k = 3 brings it to order 3 at least, and to five instants at least at which events are looked for. Where
// none can be and R is exact to a small part of the tolerance, one step does.
constexpr int least_halvings = 3, most_halvings = 48;
// How far below the tolerance the first step's deviation from R stays: backward Euler overrates it by R's order.
constexpr double first_step_margin = 1000.0;
constexpr std::size_t least_order = 4;  ///< of R, where the motion is resolved and smooth

enum Unknown { q, p, A, B, e, unknowns };

std::vector<Crossing> crossings(const Parameters& parameters) {
  return parameters.stop_enabled ? std::vector<Crossing>{Crossing::falling, Crossing::rising} : std::vector<Crossing>{};
}

}  // namespace

Flight::Flight(const Motion& motion, const Parameters& parameters)
    : Segment(motion, parameters, unknowns, crossings(parameters)), stop_(parameters.stop_enabled ? own_ : -1) {}

void Flight::prepare() {
  const Start& start = start_;
  const double H = start.size, z = start.z;
  const Compliance& contact = motion_.compliance();

  Expansion motion(start.y, z, start.depth, loads_, H);
  const auto extend_to = [&](std::size_t highest) {
    while (motion.highest < highest) motion_.extend(motion, touching_, loads_, H);
  };
  touching_ = false;
  extend_to(least_order + 1);
  if (parameters_.compliant() && Watch::direction(motion.depth) > 0.0) {
    touching_ = true;
    motion = Expansion(start.y, z, start.depth, loads_, H);
    extend_to(least_order + 1);
  }
  if (start.released) motion.y[2] = 0.0;
  const Series &y = motion.y, &depth = motion.depth;
  meet(touching_, depth);
  if (parameters_.stop_enabled) {
    Series gap = y;
    gap[0] = start.gap;
    stop_watch_ = Watch(gap);
  }

  const double travel = std::abs(y[1]) + std::abs(y[2]), acceleration = 2.0 * y[2] / H / H;
  const double depth_travel = std::abs(depth[1]) + std::abs(depth[2]), depth_rate = depth[1] / H;
  const double force = touching_ ? contact.force(start.depth, depth_rate) : 0.0;
  const double rate =
      motion_.rate(std::abs(start.y) + travel,
                   touching_ ? contact.slopes(start.depth + depth_travel, depth_rate) : Compliance::Slopes{});
  const bool resolved = H * rate <= resolved_limit;
  const bool smooth = !touching_ || contact.polynomial() || start.depth > 2.0 * depth_travel;
  const std::size_t most = smooth ? max_order : contact.analytic() ? least_order : 2;

  // Tolerances: of y and z by what they and their change over the step (or over 1/rate) are, then scaled.
  const double span = std::min(H, 1.0 / std::max(rate, std::numeric_limits<double>::min()));
  const double noise = noise_margin * epsilon * force / motion_.mass() * span;
  const double velocity = std::abs(z) + std::abs(acceleration) * span;
  const double displacement = std::abs(start.y) + velocity * span;
  const double share = safety / (1.0 + safety_per_rate * std::min(H * rate, resolved_limit));
  const auto tolerance_of = [&](double size, double least) {
    return std::max(
        {share * (parameters_.relative_tolerance * size + parameters_.absolute_tolerance), finest * size, least});
  };
  const double tolerance_z = tolerance_of(velocity, std::max(noise, smallest));
  const double tolerance_y = tolerance_of(displacement, std::max(noise * span, smallest));
  double* tolerance = solver_.absolute_tolerance();
  tolerance[q] = tolerance[A] = tolerance[B] = tolerance_y;
  tolerance[p] = H * tolerance_z;
  const double lost = touching_ ? contact.continued(start.depth, depth_rate).dissipation : 0.0;
  tolerance[e] =
      motion_.mass() * (velocity + tolerance_z) * tolerance_z + noise_margin * epsilon * span * std::abs(lost);

  // R ends where the first term that it leaves out is small. The first step is as long as that keeps the error of the
  // low orders that IDA begins with.
  const double small = H * share * parameters_.relative_tolerance * velocity / first_step_margin;
  const auto neglected = [&] {
    const auto k = static_cast<double>(motion.highest);
    return k * std::abs(y[motion.highest]) + H * rate * (H * rate) * std::abs(y[motion.highest - 1]);
  };
  int order = resolved ? 2 : 0;
  double h = 1.0;
  const auto limit = [&h](double bound, double exponent) {
    if (bound < std::numeric_limits<double>::max()) h = std::min(h, std::pow(bound, exponent));
  };
  if (resolved && most > 2) {
    while (motion.highest <= most && neglected() > small) extend_to(motion.highest + 1);
    order = static_cast<int>(motion.highest) - 1;
    limit(tolerance[p] / (first_step_margin * neglected()), 1.0 / order);
  } else {
    limit(tolerance[p] / std::abs(6.0 * y[3]), 0.5);
    if (order == 0) limit(tolerance_y / std::abs(2.0 * y[2]), 0.5);
  }
  const double levels = std::ceil(-std::log2(h));
  if (std::isnan(levels)) throw IdaError("values leave the range of floating-point numbers");
  const bool watched = parameters_.stop_enabled || parameters_.compliant();
  const double least = order > 2 && !watched ? 0.0 : least_halvings;
  int halvings = static_cast<int>(std::clamp(levels, least, double{most_halvings}));
  if (touching_ && order <= 2) {
    // The power law has no second derivative or outgrows its rates at the start: the velocity from its growth instead.
    const auto growth = [&](double s) {
      const double deeper = start.depth + s * (std::abs(depth[1]) + s * std::abs(depth[2]));
      return s * H * (contact.force(deeper, depth_rate) - force) / motion_.mass();
    };
    while (halvings < most_halvings && growth(std::ldexp(1.0, -halvings)) > tolerance_z) ++halvings;
  }

  R_ = Taylor(y, order);
  remainder_ = motion_.remainder(R_, loads_, H);
  contact_order_ = touching_ ? order - 2 : -1;
  for (std::size_t k = 0; static_cast<int>(k) <= contact_order_; ++k) {
    contact_taylor_[k] = motion.contact.elastic[k] + motion.contact.damping[k];
    dissipation_taylor_[k] = motion.contact.dissipation[k];
  }

  double* Y = solver_.initial_value();
  double* Yp = solver_.initial_derivative();
  std::fill(Y, Y + unknowns, 0.0);
  std::fill(Yp, Yp + unknowns, 0.0);
  Y[p] = Yp[q] = y[1] - R_.rate(0.0);
  Yp[p] = order == 0 ? 2.0 * y[2] : 0.0;
  if (order == 0) Yp[e] = H * (motion_.damping() * z * z + lost);
  const double relative = std::max(share * parameters_.relative_tolerance, 50.0 * epsilon);
  solver_.start(*this, relative, std::ldexp(1.0, -halvings), start.most_steps);
}

Flight::Event Flight::run(const Start& start) {
  begin(start);
  prepare();
  Event event = Event::none;
  while (event == Event::none && solver_.advance() == IdaSolver::Outcome::event) {
    if (stop_ >= 0 && solver_.fell(stop_))
      event = Event::stop;
    else if (contact_ >= 0 && solver_.fell(contact_))
      event = Event::contact;
  }
  finish();
  if (event == Event::none && parameters_.stop_enabled &&
      start.gap + (reached_.y - start.y) < -solver_.absolute_tolerance()[q])
    throw IdaError("the top passed the stop unnoticed");
  return event;
}

double Flight::displacement() const { return start_.y + (R_.rise(solver_.s()) + solver_.value()[q]); }

void Flight::finish() {
  const double H = start_.size, s = solver_.s();
  const double* Y = solver_.value();
  auto& [y, z, integral, integral_2, dissipated, impulse] = reached_;
  y = displacement();
  z = (R_.order() > 0 ? start_.z : 0.0) + (R_.rate_rise(s) + Y[p]) / H;
  integral = H * (R_.integral(s) + Y[A]);
  integral_2 = H * H * (R_.integral_2(s) + Y[B]);
  dissipated = Y[e];
  if (motion_.damping() > 0.0) dissipated += motion_.damping() / H * R_.squared_rate_integral(s);
  for (int k = 0; k <= contact_order_; ++k)
    dissipated += H * dissipation_taylor_[static_cast<std::size_t>(k)] * std::pow(s, k + 1) / (k + 1);
}

bool Flight::residual(double s, const double* Y, const double* Yp, double* F) const noexcept {
  const double H = start_.size, slope = R_.rate(s), w = Y[p] / H;
  Compliance::Effect contact{};  // in excess of the Taylor terms
  if (touching_) {
    const double depth_rate = contact_rate(slope + Y[p], s) / H;
    contact = motion_.compliance().continued(contact_depth(R_.rise(s) + Y[q], s), depth_rate);
    contact.force -= sum_of_powers(contact_taylor_, s, 0, contact_order_);
    contact.dissipation -= sum_of_powers(dissipation_taylor_, s, 0, contact_order_);
  }
  F[q] = Yp[q] - Y[p];
  F[p] = Yp[p] - H * H * motion_.excess_acceleration(R_(s), Y[q], w, remainder_(s), contact.force);
  F[A] = Yp[A] - Y[q];
  F[B] = Yp[B] - Y[A];
  F[e] = Yp[e] - (motion_.damping() * w * (2.0 * slope + Y[p]) + H * contact.dissipation);
  return std::isfinite(F[p]) && std::isfinite(F[e]);
}

void Flight::jacobian(double s, double c, const double* Y, const double*, double* J) const noexcept {
  const double H = start_.size, rise = R_.rise(s) + Y[q], slope = R_.rate(s) + Y[p];
  Compliance::Slopes contact{};
  if (touching_) contact = motion_.compliance().slopes(contact_depth(rise, s), contact_rate(slope, s) / H);
  const auto at = [J](int row, int column) -> double& { return J[column * unknowns + row]; };
  for (int i = 0; i < unknowns; ++i) at(i, i) = c;
  at(q, p) = -1.0;
  at(p, q) = -H * H * motion_.acceleration_by_displacement(start_.y + rise, contact.force_by_depth);
  at(p, p) = c - H * motion_.acceleration_by_velocity(contact.force_by_rate);
  at(A, q) = -1.0;
  at(B, A) = -1.0;
  at(e, q) = -H * contact.dissipation_by_depth;
  at(e, p) = -2.0 * motion_.damping() * slope / H - contact.dissipation_by_rate;
}

void Flight::events(double s, const double* Y, double* g) const noexcept {
  const double rise = R_.rise(s) + Y[q], slope = R_.rate(s) + Y[p];
  if (stop_ >= 0) {
    g[stop_] = stop_watch_.distance(start_.gap + rise, s);
    g[stop_ + 1] = stop_watch_.rate(slope, s);
  }
  contact_events(rise, slope, s, g);
}

}  // namespace spring
