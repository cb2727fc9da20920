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
// An oscillation is flown through in parts, H × (rate of the spring) long at most: there R, of max_order at most, is
// exact to a small part of the tolerance, and IDA confirms that in a step or two.
double part_length(const Parameters& parameters) {
  const double tolerance = std::max(parameters.relative_tolerance, 1e-15);
  return 0.25 * std::pow(tolerance / 1e-12, 1.0 / (max_order + 1));
}
// Where damping rules, IDA's own steps outgrow such parts. Taylor terms are then used while H × rate is below this;
// beyond, they would only cancel.
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

}  // namespace

Flight::Flight(const Motion& motion, const Parameters& parameters)
    : motion_(motion),
      parameters_(parameters),
      distances_{parameters.stop_enabled, parameters.compliant()},
      part_(part_length(parameters)),
      solver_(unknowns) {}

Flight::Reached Flight::run(const Start& start) {
  start_ = start;
  begin(start.size);
  Expansion motion = expand();
  Pace pace = this->pace(motion);
  while (size_ * pace.rate > part_ && 2.0 * pace.oscillation > pace.rate) {
    begin(std::clamp(part_ / pace.rate, size_ / 16, size_ / 2));
    motion = expand();
    pace = this->pace(motion);
  }
  const Tolerances tolerances = this->tolerances(pace);
  const Opening opening = open(motion, pace, tolerances);
  launch(motion, pace, tolerances, opening);

  const auto event = static_cast<Event>(solver_.advance());
  const double H = size_, s = solver_.s(), y = displacement();
  if (event == Event::none && parameters_.stop_enabled && start.gap + (y - start.y) < -tolerances.y)
    throw IdaError("the top passed the stop unnoticed");
  const double* Y = solver_.value();
  double dissipated = Y[e];
  if (motion_.damping() > 0.0) dissipated += motion_.damping() / H * R_.squared_rate_integral(s);
  for (int k = 0; k <= contact_order_; ++k)
    dissipated += H * dissipation_taylor_[static_cast<std::size_t>(k)] * std::pow(s, k + 1) / (k + 1);
  const double z = (R_.order() > 0 ? start_.z : 0.0) + (R_.rate_rise(s) + Y[p]) / H;
  return {event, y, z, H * (R_.integral(s) + Y[A]), H * H * (R_.integral_2(s) + Y[B]), dissipated};
}

void Flight::begin(double size) {
  size_ = size;
  loads_ = start_.loads.scaled(size);
}

/// Finds out, too, whether the top touches the tip.
Expansion Flight::expand() {
  for (touching_ = false;; touching_ = true) {
    Expansion motion(start_.y, start_.z, start_.depth, loads_, size_);
    while (motion.highest <= least_order) motion_.extend(motion, touching_, loads_, size_);
    if (start_.released) motion.y[2] = 0.0;
    if (touching_ || !parameters_.compliant() || direction(motion.depth) <= 0.0) return motion;
  }
}

Flight::Pace Flight::pace(const Expansion& motion) const {
  const double H = size_;
  const Compliance& contact = motion_.compliance();
  const Series &y = motion.y, &depth = motion.depth;
  const double travel = std::abs(y[1]) + std::abs(y[2]), depth_travel = std::abs(depth[1]) + std::abs(depth[2]);
  Pace pace{};
  pace.depth_rate = depth[1] / H;
  Compliance::Slopes slopes{};
  if (touching_) {
    pace.force = contact.force(start_.depth, pace.depth_rate);
    pace.lost = contact.continued(start_.depth, pace.depth_rate).dissipation;
    slopes = contact.slopes(start_.depth + depth_travel, pace.depth_rate);
  }
  const auto rates = motion_.rates(std::abs(start_.y) + travel, slopes);
  pace.oscillation = rates.oscillation;
  pace.rate = rates.oscillation + rates.decay;
  pace.smooth = !touching_ || contact.polynomial() || start_.depth > 2.0 * depth_travel;
  pace.span = std::min(H, 1.0 / std::max(pace.rate, std::numeric_limits<double>::min()));
  pace.velocity = std::abs(start_.z) + std::abs(2.0 * y[2] / H / H) * pace.span;
  pace.displacement = std::abs(start_.y) + pace.velocity * pace.span;
  return pace;
}

/// Of y and z by what they and their change over the segment (or over 1/rate) are.
Flight::Tolerances Flight::tolerances(const Pace& pace) const {
  const double noise = noise_margin * epsilon * pace.force / motion_.mass() * pace.span;
  const double share = safety / (1.0 + safety_per_rate * std::min(size_ * pace.rate, resolved_limit));
  const auto tolerance = [&](double size, double least) {
    return std::max({share * (parameters_.relative_tolerance * size + parameters_.absolute_tolerance), finest * size,
                     least, smallest});
  };
  const double z = tolerance(pace.velocity, noise), y = tolerance(pace.displacement, noise * pace.span);
  const double e = motion_.mass() * (pace.velocity + z) * z + noise_margin * epsilon * pace.span * std::abs(pace.lost);
  return {share, y, z, e};
}

/// R ends where the first term that it leaves out is small. The first step is as long as that keeps the error of the
/// low orders that IDA begins with.
Flight::Opening Flight::open(Expansion& motion, const Pace& pace, const Tolerances& tolerances) const {
  const double H = size_;
  const Compliance& contact = motion_.compliance();
  const Series &y = motion.y, &depth = motion.depth;
  const bool resolved = H * pace.rate <= resolved_limit;
  const std::size_t most = pace.smooth ? max_order : contact.analytic() ? least_order : 2;
  const auto neglected = [&] {
    const auto k = static_cast<double>(motion.highest);
    return k * std::abs(y[motion.highest]) + H * pace.rate * (H * pace.rate) * std::abs(y[motion.highest - 1]);
  };
  Opening opening{resolved ? 2 : 0, 0};
  double h = 1.0;
  const auto limit = [&h](double bound, double exponent) {
    if (bound < std::numeric_limits<double>::max()) h = std::min(h, std::pow(bound, exponent));
  };
  if (resolved && most > 2) {
    const double small = H * tolerances.share * parameters_.relative_tolerance * pace.velocity / first_step_margin;
    while (motion.highest <= most && neglected() > small) motion_.extend(motion, touching_, loads_, H);
    opening.order = static_cast<int>(motion.highest) - 1;
    limit(H * tolerances.z / (first_step_margin * neglected()), 1.0 / opening.order);
  } else {
    limit(H * tolerances.z / std::abs(6.0 * y[3]), 0.5);
    if (opening.order == 0) limit(tolerances.y / std::abs(2.0 * y[2]), 0.5);
  }
  const double levels = std::ceil(-std::log2(h));
  if (std::isnan(levels)) throw IdaError("values leave the range of floating-point numbers");
  const double least = opening.order > 2 && !within_reach(motion) ? 0.0 : least_halvings;
  opening.halvings = static_cast<int>(std::clamp(levels, least, double{most_halvings}));
  if (touching_ && opening.order <= 2) {
    // The power law has no second derivative or outgrows its rates at the start: the velocity from its growth instead.
    const auto growth = [&](double s) {
      const double deeper = start_.depth + s * (std::abs(depth[1]) + s * std::abs(depth[2]));
      return s * H * (contact.force(deeper, pace.depth_rate) - pace.force) / motion_.mass();
    };
    while (opening.halvings < most_halvings && growth(std::ldexp(1.0, -opening.halvings)) > tolerances.z)
      ++opening.halvings;
  }
  return opening;
}

/// Whether the stop or the tip may be met, were the motion its Taylor polynomial.
bool Flight::within_reach(const Expansion& motion) const {
  const auto travels = [&](const Series& c, double distance) {
    double way = 0.0;
    for (std::size_t k = 1; k <= motion.highest; ++k) way += std::abs(c[k]);
    return 1.01 * way >= std::abs(distance);
  };
  return (parameters_.stop_enabled && travels(motion.y, start_.gap)) ||
         (parameters_.compliant() && travels(motion.depth, start_.depth));
}

void Flight::launch(const Expansion& motion, const Pace& pace, const Tolerances& tolerances, const Opening& opening) {
  const double H = size_, z = start_.z;
  const Series& y = motion.y;
  R_ = Taylor(y, opening.order);
  remainder_ = motion_.remainder(R_, loads_, H);
  contact_order_ = touching_ ? opening.order - 2 : -1;
  for (std::size_t k = 0; static_cast<int>(k) <= contact_order_; ++k) {
    contact_taylor_[k] = motion.contact.elastic[k] + motion.contact.damping[k];
    dissipation_taylor_[k] = motion.contact.dissipation[k];
  }
  double* tolerance = solver_.absolute_tolerance();
  tolerance[q] = tolerance[A] = tolerance[B] = tolerances.y;
  tolerance[p] = H * tolerances.z;
  tolerance[e] = tolerances.e;
  double* Y = solver_.initial_value();
  double* Yp = solver_.initial_derivative();
  std::fill(Y, Y + unknowns, 0.0);
  std::fill(Yp, Yp + unknowns, 0.0);
  Y[p] = Yp[q] = y[1] - R_.rate(0.0);
  Yp[p] = opening.order == 0 ? 2.0 * y[2] : 0.0;
  if (opening.order == 0) Yp[e] = H * (motion_.damping() * z * z + pace.lost);
  const double relative = std::max(tolerances.share * parameters_.relative_tolerance, 50.0 * epsilon);
  solver_.start(*this, relative, std::ldexp(1.0, -opening.halvings), start_.most_steps);
}

double Flight::contact_depth(double rise, double s) const {
  const auto& u = loads_.tip;
  return start_.depth + rise - s * (u[1] + s * u[2] / 2);
}

bool Flight::residual(double s, const double* Y, const double* Yp, double* F) const noexcept {
  const double H = size_, slope = R_.rate(s), w = Y[p] / H;
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
  const double H = size_, rise = R_.rise(s) + Y[q], slope = R_.rate(s) + Y[p];
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

Distance Flight::distance(int which, double s, const double* Y) const noexcept {
  const double rise = R_.rise(s) + Y[q], slope = R_.rate(s) + Y[p];
  if (!distances_[which]) return {1.0, 1.0};
  if (static_cast<Event>(which) == Event::stop) return {start_.gap + rise, slope};
  const double sign = touching_ ? 1.0 : -1.0;
  return {sign * contact_depth(rise, s), sign * contact_rate(slope, s)};
}

}  // namespace spring
