#include "flight.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace spring {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr const char* out_of_range = "values leave the range of floating-point numbers";

// What a series leaves out, of the tolerance: below rounding at the default one, so that y(t+H) is smooth in the
// forces; and never less than what rounding leaves of it anyway.
constexpr double share = 1e-5, least_share = 0.01 * epsilon;
// Forces of second order in time, which act on the fourth power, are in every series.
constexpr std::size_t least_order = 4;
// Sizes are estimates: the next is at least so much smaller that few are needed, and at most so much that none is far
// too small.
constexpr double least_cut = 0.5, most_cut = 1.0 / 16.0;
// A part whose series ends too early is cut by the root of the excess, or by this where rounding leaves none.
constexpr double least_shortening = 0.9;
// A power law δ^p of other p than 1, 2, 3, 4 has a series as far as δ does not change by more than this part of it;
// where that is for parts below this fraction of the time in which the motion changes, IDA needs fewer steps.
constexpr double part_of_depth = 0.5, least_part = 0.1;
// A series serves for about 1/rate; over a longer span, where the motion dies out, IDA needs some hundred steps, each
// as long as a series takes.
constexpr double most_decay = 100.0;

}  // namespace

Flight::Flight(const EquationOfMotion& equation, const Parameters& parameters)
    : equation_(equation), parameters_(parameters), integrated_(equation, parameters) {}

const FlightEnd& Flight::run(const Start& start) {
  start_ = start;
  end_ = {Event::none, 0.0, false, start.y, start.z, 0.0, 0.0, 0.0, 0};
  Expansion motion = expand(start.size);
  EquationOfMotion::Rates rates = this->rates(motion);
  while (motion.size * rates.sum() > 1.0) {
    motion = expand(std::clamp(1.0 / rates.sum(), most_cut * motion.size, least_cut * motion.size));
    rates = this->rates(motion);
  }
  bool in_parts = rates.decay <= rates.oscillation || start.size * rates.decay <= most_decay;
  for (; in_parts && !analytic(motion); in_parts = motion.size * rates.sum() > least_part) {
    motion = expand(least_cut * motion.size);
    rates = this->rates(motion);
  }
  if (in_parts) {
    complete(motion);
    end_ = follow(motion);
  } else {
    integrated_.run(start_, motion.touching, end_);
  }
  return end_;
}

/// The first coefficients; finds out, too, whether the top touches the tip.
Expansion Flight::expand(double size) {
  for (bool touching = false;; touching = true) {
    Expansion motion(equation_.elongation(start_.y), start_.z, start_.depth, start_.loads, size, touching);
    while (motion.highest <= least_order) equation_.extend(motion);
    if (start_.released) {  // what the force leaves there is rounding
      start_.loads.force[0] -= 2.0 * equation_.mass() * motion.x[2] / (size * size);
      motion.loads = start_.loads.scaled(size);
      motion.x[2] = 0.0;
    }
    if (touching || !parameters_.compliant() || direction(motion.depth) <= 0.0) return motion;
  }
}

EquationOfMotion::Rates Flight::rates(const Expansion& motion) const {
  const Series &x = motion.x, &depth = motion.depth;
  Compliance::Slopes slopes{};
  if (motion.touching) {
    const double deepest = start_.depth + std::abs(depth[1]) + std::abs(depth[2]);
    slopes = equation_.compliance().slopes(deepest, depth[1] / motion.size);
  }
  const auto rates = equation_.rates(std::abs(x[0]) + std::abs(x[1]) + std::abs(x[2]), slopes);
  if (!std::isfinite(rates.sum())) throw SolverError(out_of_range);
  return rates;
}

/// Whether the contact force is, as far as the part goes.
bool Flight::analytic(const Expansion& motion) const {
  if (!motion.touching) return true;
  const Compliance& law = equation_.compliance();
  const Series& depth = motion.depth;
  double change = 0.0, change_of_rate = 0.0;  // of the depth
  for (std::size_t k = 1; k <= least_order; ++k) {
    change += std::abs(depth[k]);
    if (k > 1) change_of_rate += static_cast<double>(k) * std::abs(depth[k]) / motion.size;
  }
  const bool smooth_power = law.polynomial() || change <= part_of_depth * start_.depth;
  return smooth_power &&
         (!law.damped() || law.keeps_side(start_.depth, depth[1] / motion.size, change, change_of_rate));
}

/// The series ends where the first coefficient that it leaves out is small, and the equation of motion at the part's
/// end shows no more of the others: from rest those of a power law or of a cubic spring are 0 up to a high order. Where
/// the highest order is not enough the part is shortened.
void Flight::complete(Expansion& motion) const {
  const Series& c = motion.touching ? motion.depth : motion.x;
  const double part = std::max(share * parameters_.relative_tolerance, least_share);
  const auto allowed = [&] {
    return part * std::max({std::abs(c[1]), std::abs(c[2]), std::abs(c[3]), std::abs(c[4])});
  };
  const auto neglected = [&] {
    const double n = static_cast<double>(motion.highest), first = n * std::abs(c[motion.highest]);
    return first > allowed() ? first : equation_.residual(motion) / (n - 1.0);
  };
  const auto excess = [&] { return !(neglected() <= allowed()); };
  while (motion.highest <= max_order && excess()) equation_.extend(motion);
  while (excess()) {
    const double root = std::pow(allowed() / neglected(), 1.0 / max_order);
    if (!(root > 0.0)) throw SolverError(out_of_range);
    motion.shorten(std::min(root, least_shortening), start_.loads);
  }
}

/// To the first event or to the part's end, with the integrals of the series.
FlightEnd Flight::follow(const Expansion& motion) const {
  const int order = static_cast<int>(motion.highest) - 1;
  Series gap = motion.x;
  gap[0] = start_.gap;
  const auto [event, s] = first_event(parameters_, gap, motion.depth, motion.touching, order);

  const double H = motion.size, y = start_.y;
  double rise = 0.0, faster = 0.0, integral = 0.0, integral_2 = 0.0;
  for (int k = order; k > 0; --k) {
    const double c = motion.x[static_cast<std::size_t>(k)];
    rise = (rise + c) * s;
    integral = (integral + c / (k + 1)) * s;
    integral_2 = (integral_2 + c / ((k + 1) * (k + 2))) * s;
    if (k > 1) faster = (faster + k * c) * s;
  }
  return {event,
          s * H,
          s == 1.0 && H == start_.size,
          y + rise,
          start_.z + faster / H,
          s * H * (y + integral),
          s * s * H * H * (y / 2 + integral_2),
          dissipated(motion, s),
          1};
}

/// By α_s, and by the contact: what the contact force does along the depth, less what the law stores.
double Flight::dissipated(const Expansion& motion, double s) const {
  const Compliance& law = equation_.compliance();
  const int order = static_cast<int>(motion.highest) - 1;
  const auto work = [&](const auto& force, const Series& along, int highest) {
    std::array<double, std::size_t{2} * max_order> done{};
    for (std::size_t i = 0; i <= static_cast<std::size_t>(highest); ++i)
      for (std::size_t j = 1; j < motion.highest; ++j)
        done[i + j] += force(i) * static_cast<double>(j) * along[j] / static_cast<double>(i + j);
    return sum_of_powers(done, s, 1, highest + order);
  };
  double lost = 0.0;
  if (equation_.damping() > 0.0)
    lost += equation_.damping() / motion.size *
            work([&](std::size_t i) { return static_cast<double>(i + 1) * motion.x[i + 1]; }, motion.x, order - 1);
  if (motion.touching && law.damped())
    lost += work([&](std::size_t i) { return motion.contact.elastic[i] + motion.contact.damping[i]; }, motion.depth,
                 order - 2) -
            (law.energy(sum_of_powers(motion.depth, s, 0, order)) - law.energy(start_.depth));
  return lost;
}

}  // namespace spring
