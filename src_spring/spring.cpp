#include "spring.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "seated.hpp"

namespace spring {

namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();
/// In one step, counted in series and steps of IDA: some two thousand periods of the spring. A step that needs more is
/// refused, so that no call lasts longer than a second or two. To start a segment costs as much as some steps.
constexpr long most_work = 250'000;
constexpr double smallest_step = 1e-100;  ///< [s], whose square, of a series, is far above the least number
constexpr double far = 1e9;               ///< as many hilltops away, nothing brings a top back

}  // namespace

/// One step of a spring: a sequence of segments, each smooth, joined by events. Leaves the spring as it is.
class Spring::Step {
 public:
  Step(Spring& spring, double time, double size, const Loads& loads)
      : spring_(spring),
        start_(time),
        parameters_(spring.parameters_),
        state_(spring.state_),
        size_(size),
        loads_(loads),
        last_(state_.meeting != 0.0 && std::abs(state_.y - loads.tip[0]) <= tolerance() ? Event::contact
                                                                                        : Event::none) {}

  Reached run(bool to_event) {
    state_.integral = state_.integral_2 = state_.stop_force = state_.stop_impulse = 0.0;
    state_.meeting = 0.0;
    try {
      while (remaining() > 0.0 && !(to_event && ends())) {
        arrive();
        last_ = state_.seated != 0.0 ? stay() : rests() ? rest() : fly();
      }
    } catch (const SolverError& error) {
      fail(error.what(), spring_.flight_.end().y, t_ + spring_.flight_.end().elapsed);
    }
    const Reached reached{remaining() > 0.0 ? t_ : size_, to_event && ends()};
    state_.stop_force = seated_impulse_ / reached.size;
    if (reached.event && last_ == Event::contact) state_.meeting = 1.0;
    return reached;
  }

  /// Where the segment at t_ starts, with what happens there.
  void arrive() {
    now_ = loads_.from_time(t_);
    depth_ = !parameters_.compliant() ? -1.0 : last_ == Event::contact ? 0.0 : state_.y - now_.tip[0];
    if (parameters_.stop_enabled) land();
  }

  const State& state() const { return state_; }

 private:
  /// Whether an event lies at t_, later than the start by more than rounding.
  bool ends() const { return last_ != Event::none && t_ > 4.0 * epsilon * size_ && start_ + t_ > start_; }

  /// To which y is known [m].
  double tolerance() const {
    return parameters_.relative_tolerance * std::abs(state_.y) + parameters_.absolute_tolerance;
  }

  /// What is left, or 0 where that is rounding.
  double remaining() const {
    const double left = size_ - t_;
    return left > 4.0 * epsilon * size_ ? left : 0.0;
  }

  bool touching() const {
    const auto& u = now_.tip;
    return parameters_.compliant() && direction<3>({depth_, state_.z - u[1], -u[2] / 2}) > 0.0;
  }

  /// At the foundation: rebound, or stay seated, or leave.
  /// Deviation: impacts that die out are cut short when the top, pressed down, would rise no higher than the solver's
  /// tolerance of y; its last velocity is then lost too.
  void land() {
    const double gap = state_.y - parameters_.stop_position;
    if (gap > 0.0) return;
    const auto N = spring_.equation_.holding_force(state_.y, now_, touching(), depth_);
    const bool pressed = direction<3>({N[0], N[1], N[2] / 2}) >= 0.0;
    const double before = state_.z;
    if (before < 0.0) {
      const double pull = std::max(N[0], 0.0) / parameters_.mass;  // −ÿ
      const double rebound = -parameters_.restitution * before;
      const bool dies_out = rebound * rebound <= 2.0 * pull * tolerance();
      state_.z = dies_out ? 0.0 : rebound;
      state_.impacts += 1.0;
      state_.last_impact = start_ + t_;
      state_.stop_impulse += parameters_.mass * (state_.z - before);
      state_.impact_loss += parameters_.mass / 2 * (before * before - state_.z * state_.z);
    }
    state_.seated = state_.z == 0.0 && pressed && last_ != Event::release ? 1.0 : 0.0;
  }

  /// Keeps y over `size` [s].
  void hold(double size) {
    state_.integral_2 += (state_.integral + state_.y * size / 2) * size;
    state_.integral += state_.y * size;
  }

  Event stay() {
    const SeatedEnd stayed =
        stay_seated(spring_.equation_, state_.y, depth_, parameters_.compliant(), now_, remaining());
    hold(stayed.size);
    state_.dissipated += stayed.dissipated;
    seated_impulse_ += stayed.impulse;
    t_ = stayed.released ? t_ + stayed.size : size_;
    if (!stayed.released) return Event::none;
    state_.seated = 0.0;
    return Event::release;
  }

  /// Whether nothing moves the top, out of reach of a tip, for the rest of the step: for as long as that may be.
  bool rests() const {
    const double held = spring_.equation_.spring_force(state_.y), &force = now_.force[0];
    const bool constant = now_.force[1] == 0.0 && now_.force[2] == 0.0;
    const bool out_of_reach = !parameters_.compliant() || (depth_ < 0.0 && now_.tip[1] == 0.0 && now_.tip[2] == 0.0);
    return state_.z == 0.0 && constant && out_of_reach &&
           std::abs(force - held) <= 4.0 * epsilon * (std::abs(force) + std::abs(held));
  }

  Event rest() {
    hold(size_ - t_);
    t_ = size_;
    return Event::none;
  }

  Event fly() {
    const double gap = parameters_.stop_enabled ? state_.y - parameters_.stop_position : 1.0;
    if (work_ >= most_work) fail("it spans too much of the motion", state_.y, t_);
    const bool released = last_ == Event::release;
    const FlightEnd came =
        spring_.flight_.run({state_.y, state_.z, now_, remaining(), gap, depth_, released, most_work - work_});
    state_.steps += static_cast<double>(came.steps);
    work_ += came.steps;
    state_.integral_2 += state_.integral * came.elapsed + came.integral_2;
    state_.integral += came.integral;
    state_.dissipated += came.dissipated;
    state_.y = came.y;
    state_.z = came.z;
    t_ = came.at_end ? size_ : t_ + came.elapsed;
    if (std::abs(came.y - parameters_.unloaded) > far * parameters_.hilltop()) fail("it goes on for ever", came.y, t_);
    // Rounding must not put the top below the stop. Not from the gap: a distant stop would quantise y.
    if (parameters_.stop_enabled)
      state_.y = came.event == Event::stop ? parameters_.stop_position : std::max(came.y, parameters_.stop_position);
    return came.event;
  }

  /// Past the hilltop, a motion that nothing brings back reaches infinity in finite time, where the solver fails.
  [[noreturn]] void fail(const std::string& why, double y, double done) const {
    const bool away = std::abs(y - parameters_.unloaded) > parameters_.hilltop();
    throw StepFailure("spring: a step of " + number(size_) + " s fails after " + number(done) + " s: " +
                      (away ? "the top has run away, past its hilltop |y - unloaded| = " +
                                  number(parameters_.hilltop()) + " m, where a softening spring pushes outwards"
                            : why + "; use a smaller step size"));
  }

  Spring& spring_;
  const double start_;  ///< [s]
  const Parameters& parameters_;
  State state_;
  const double size_;
  const Loads loads_;
  double t_ = 0.0;               ///< since the step's start
  long work_ = 0;                ///< what was done so far
  Loads now_;                    ///< loads_ from t_ on
  double depth_ = -1.0;          ///< y − u_tip at t_
  Event last_;                   ///< with which the part before t_ ended; contact: y = u_tip, release: N = 0
  double seated_impulse_ = 0.0;  ///< ∫N while seated
};

Spring::Spring(const Parameters& p)
    : parameters_((check(p), p)), equation_(p), flight_(equation_, parameters_), state_{p.displacement, p.velocity} {
  state_.seated = can_rest() ? 1.0 : 0.0;
}

Reached Spring::step_to_event(double size, const Inputs& inputs, double time, bool to_event) {
  if (size < smallest_step)
    throw StepFailure("spring: a step of " + number(size) + " s is too small, its square underflows; use a step size " +
                      "of at least " + number(smallest_step) + " s");
  const Loads loads = Loads::from(parameters_, inputs);
  const State before = state_;
  Step step(*this, time, size, loads);
  const Reached reached = step.run(to_event);
  state_ = step.state();
  const double done = reached.size;
  observe(loads.from_time(done));
  // Impacts turn the velocity around, y goes on: the step's integrals know the work through all of its events.
  state_.load_work += work(load_of(parameters_, inputs), done, state_.y - before.y, state_.integral - before.y * done,
                           state_.integral_2 - before.y * done * done / 2);
  if (!finite()) {
    state_ = before;
    throw StepFailure("spring: the motion leaves the range of floating-point numbers in a step of " + number(size) +
                      " s; use a smaller step size or smaller inputs");
  }
  return reached;
}

void Spring::strike(double time) {
  if (state_.z >= 0.0) return;  // it rests, or leaves: the next step finds out under the inputs as they then change
  Step step(*this, time, 0.0, {{state_.observed.force, 0.0, 0.0}, tip()});
  step.arrive();
  state_ = step.state();
}

bool Spring::finite() const {
  // A sum is not finite where one of its terms is not.
  const State& s = state_;
  return std::isfinite(s.y + s.z + s.integral + s.integral_2 + s.dissipated + s.impact_loss + s.load_work +
                       s.stop_force + s.stop_impulse + s.observed.force + tip()[0] + tip()[1] + tip()[2] +
                       acceleration() + reaction() + kinetic_energy() + potential_energy() + contact_energy());
}

void Spring::apply_impulse(double impulse) {
  state_.z += impulse / parameters_.mass;
  if (state_.z != 0.0) state_.seated = 0.0;
}

/// The sign of the force that holds the top decides, or what was where that is rounding.
bool Spring::seated() const {
  if (!can_rest()) return false;
  const Loads now{{state_.observed.force, 0.0, 0.0}, tip()};
  const double N = equation_.holding_force(state_.y, now, depth() > 0.0, depth())[0];
  const double terms = std::abs(state_.observed.force) + std::abs(spring_force()) + std::abs(reaction());
  return std::abs(N) > 8.0 * epsilon * terms ? N > 0.0 : state_.seated != 0.0;
}

double Spring::acceleration() const {
  return seated() ? 0.0 : equation_.acceleration(state_.y, state_.z, state_.observed.force, reaction());
}
double Spring::jerk(double force_rate, double reaction_rate) const {
  if (seated()) return 0.0;
  return (force_rate - reaction_rate - parameters_.damping * acceleration()) / parameters_.mass +
         equation_.acceleration_by_displacement(state_.y, 0.0) * state_.z;
}
double Spring::reaction() const {
  return parameters_.compliant() ? equation_.compliance().force(depth(), state_.z - tip()[1]) : 0.0;
}
Compliance::Slopes Spring::reaction_slopes() const {
  if (depth() <= 0.0) return {};
  return equation_.compliance().slopes(depth(), state_.z - tip()[1]);
}
double Spring::kinetic_energy() const { return parameters_.mass / 2 * state_.z * state_.z; }
double Spring::potential_energy() const { return equation_.potential_energy(state_.y); }
double Spring::spring_force() const { return equation_.spring_force(state_.y); }
double Spring::contact_energy() const { return equation_.compliance().energy(depth()); }

}  // namespace spring
