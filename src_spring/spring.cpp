#include "spring.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "flat.hpp"
#include "flight.hpp"
#include "motion.hpp"
#include "parameters.hpp"
#include "seated.hpp"

namespace spring {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();
/// In one step, counted in internal steps of IDA: thousands of periods of the spring. A step that needs more is
/// refused, so that no call lasts longer than a second or two. To start a segment costs as much as some steps.
constexpr long most_work = 1'000'000, work_of_start = 20;
constexpr long most_stalled = 100;  ///< events without progress

/// Everything that a step changes; doubles only, see flat.hpp.
struct State {
  double y, z;
  double integral = 0.0, integral_2 = 0.0;
  double dissipated = 0.0, impact_loss = 0.0, load_work = 0.0;
  double stop_force = 0.0, stop_impulse = 0.0;
  double seated = 0.0;                            ///< 1 on the foundation
  double force = 0.0, tip = 0.0, tip_rate = 0.0;  ///< F, u_tip and its rate where the step ended
  double steps = 0.0;                             ///< IDA's, since the start
};

}  // namespace

struct Spring::Impl {
  const Parameters parameters;
  const Motion motion;
  const Laws laws;
  Flight flight;
  std::optional<Seated> seated;
  State state;

  explicit Impl(const Parameters& p)
      : parameters(p),
        motion(p),
        laws{hilltop(p),           p.stop_enabled,      p.stop_position, p.contact_law == ContactLaw::normal_compliance,
             p.relative_tolerance, p.absolute_tolerance},
        flight(motion, laws),
        state{p.displacement, p.velocity} {
    if (laws.stop) seated.emplace(motion, laws);
  }

  double depth(const State& s) const { return laws.compliance ? s.y - s.tip : -1.0; }
  double contact(const State& s) const {
    return laws.compliance ? motion.compliance().force(depth(s), s.z - s.tip_rate) : 0.0;
  }

  State advanced(double size, const Inputs& inputs);
};

namespace {

/// What acts at `t` is what accelerations and reactions refer to.
void see(State& state, const Loads& loads, double t) {
  state.force = value(loads.force, t);
  state.tip = value(loads.tip, t);
  state.tip_rate = rate(loads.tip, t);
}

/// One step: a sequence of segments, each smooth, joined by events.
class Step {
 public:
  Step(const Motion& motion, const Laws& laws, double restitution, Flight& flight, Seated* seat, State state,
       double size, const Loads& loads)
      : motion_(motion),
        laws_(laws),
        restitution_(restitution),
        flight_(flight),
        seat_(seat),
        state_(state),
        size_(size),
        loads_(loads) {}

  State run() {
    state_.integral = state_.integral_2 = state_.stop_force = state_.stop_impulse = 0.0;
    double held = 0.0;   // ∫N while seated
    double last = -1.0;  // event's time
    for (long stalled = 0; remaining() > 0.0; ++segments_) {
      stalled = t_ > last ? 0 : stalled + 1;
      last = t_;
      if (stalled == most_stalled)
        throw StepFailure("spring: " + std::to_string(most_stalled) + " contact events at once, " + number(t_) +
                              " s after the step's start",
                          t_);
      now_ = loads_.from_time(t_);
      depth_ = !laws_.compliance ? -1.0 : meeting_ ? 0.0 : state_.y - now_.tip[0];
      if (laws_.stop) land();
      if (seat_ != nullptr && state_.seated != 0.0)
        held += sit(*seat_);
      else
        fly();
    }
    state_.stop_force = held / size_;
    see(state_, loads_, size_);
    return state_;
  }

 private:
  /// What is left, or 0 where that is rounding.
  double remaining() const {
    const double left = size_ - t_;
    return left > 4.0 * epsilon * size_ ? left : 0.0;
  }

  bool touching() const {
    const auto& u = now_.tip;
    return laws_.compliance && Watch::direction({depth_, state_.z - u[1], -u[2], 0.0, 0.0}) > 0.0;
  }

  /// At the foundation: rebound, or come to rest, or leave.
  /// Deviation: impacts that die out are cut short when the top, pressed down, would rise no higher than the solver's
  /// tolerance of y; its last velocity is then lost too.
  void land() {
    const double gap = state_.y - laws_.stop_position;
    if (gap > 0.0) {
      state_.seated = 0.0;
      return;
    }
    const auto N = motion_.holding_force(state_.y, now_, touching(), depth_);
    const bool pressed = Seated::holds(N);
    const double before = state_.z;
    if (before < 0.0) {
      const double pull = std::max(N[0], 0.0) / motion_.mass();  // −ÿ
      const double rebound = -restitution_ * before;
      const double tolerance = laws_.relative_tolerance * std::abs(state_.y) + laws_.absolute_tolerance;
      const bool dies_out = pressed && rebound * rebound <= 2.0 * pull * tolerance;
      state_.z = dies_out ? 0.0 : rebound;
      state_.stop_impulse += motion_.mass() * (state_.z - before);
      state_.impact_loss += motion_.mass() / 2 * (before * before - state_.z * state_.z);
    }
    state_.seated = state_.z == 0.0 && pressed && !released_ ? 1.0 : 0.0;
  }

  void fly() {
    const double gap = laws_.stop ? state_.y - laws_.stop_position : 1.0;
    const FlightStart start{state_.y, state_.z, now_, remaining(), gap, depth_, released_, most_work - work_};
    const auto event = attempt(flight_, start);
    released_ = false;
    state_.integral_2 += state_.integral * flight_.elapsed() + flight_.integral_2();
    state_.integral += flight_.integral();
    state_.dissipated += flight_.dissipated();
    state_.y = flight_.displacement();
    state_.z = flight_.velocity();
    t_ += flight_.elapsed();
    if (event == Flight::Event::hilltop)
      throw Escape("spring: y = " + number(state_.y) +
                       " m has run away, past the hilltop |y| = " + number(laws_.hilltop) +
                       " m of the softening spring, reached " + number(t_) + " s after the step's start",
                   t_);
    // Rounding must not put the top below the stop. Not from the gap: a distant stop would quantise y.
    if (laws_.stop)
      state_.y = event == Flight::Event::stop ? laws_.stop_position : std::max(state_.y, laws_.stop_position);
    meeting_ = event == Flight::Event::contact;
    if (event == Flight::Event::none) t_ = size_;
  }

  /// @return ∫N
  double sit(Seated& seat) {
    const auto event = attempt(seat, SeatedStart{now_, remaining(), depth_, most_work - work_});
    const double t = seat.elapsed();
    state_.integral_2 += state_.integral * t + state_.y * t * t / 2;
    state_.integral += state_.y * t;
    state_.dissipated += seat.dissipated();
    t_ += t;
    released_ = event == Seated::Event::release;
    if (released_) state_.seated = 0.0;
    meeting_ = event == Seated::Event::contact;
    if (event == Seated::Event::none) t_ = size_;
    return seat.impulse();
  }

  template <class Phase, class Start>
  typename Phase::Event attempt(Phase& phase, const Start& start) {
    try {
      const auto event = phase.run(start);
      const long steps = phase.solver().steps();
      state_.steps += static_cast<double>(steps);
      work_ += steps + work_of_start;
      return event;
    } catch (const TooMuchWork&) {
      const double reached = t_ + phase.solver().s() * start.size;
      throw StepFailure("spring: a step of " + number(size_) + " s spans too much of the motion: " +
                            std::to_string(most_work - work_of_start * segments_) + " internal steps with " +
                            std::to_string(segments_) + " contact events reach " + number(reached) +
                            " s after its start; use a smaller step size",
                        reached);
    } catch (const IdaError& error) {
      const double reached = t_ + phase.solver().s() * start.size;
      throw StepFailure(std::string("spring: ") + error.what() + ", " + number(reached) + " s after the step's start",
                        reached);
    }
  }

  const Motion& motion_;
  const Laws& laws_;
  const double restitution_;
  Flight& flight_;
  Seated* seat_;
  State state_;
  const double size_;
  const Loads loads_;
  double t_ = 0.0;                ///< since the step's start
  long segments_ = 0, work_ = 0;  ///< done, and their internal steps
  Loads now_;                     ///< loads_ from t_ on
  double depth_ = -1.0;           ///< y − u_tip at t_
  bool meeting_ = false;          ///< tip and top are at a contact event: y = u_tip
  bool released_ = false;         ///< has just left the foundation, N = 0
};

}  // namespace

State Spring::Impl::advanced(double size, const Inputs& inputs) {
  State reached = Step(motion, laws, parameters.restitution, flight, seated ? &*seated : nullptr, state, size,
                       Loads::from(parameters, inputs))
                      .run();
  // Impacts turn the velocity around, y goes on: the step's integrals know the work through all of its events.
  reached.load_work += work(load_of(parameters, inputs), size, reached.y - state.y, reached.integral - state.y * size,
                            reached.integral_2 - state.y * size * size / 2);
  return reached;
}

Spring::Spring(const Parameters& parameters) {
  check(parameters);
  impl_ = std::make_unique<Impl>(parameters);
}
Spring::~Spring() = default;
Spring::Spring(Spring&&) noexcept = default;
Spring& Spring::operator=(Spring&&) noexcept = default;

void Spring::step(double size, const Inputs& inputs) {
  if (!(size > 0.0) || !std::isfinite(size))
    throw std::invalid_argument("spring: step size = " + number(size) + ": must be > 0 and finite");
  check(inputs);
  const State before = impl_->state;
  impl_->state = impl_->advanced(size, inputs);
  if (!finite()) {
    impl_->state = before;
    throw StepFailure("spring: the motion leaves the range of floating-point numbers in a step of " + number(size) +
                          " s; use a smaller step size or smaller inputs",
                      0.0);
  }
}

bool Spring::finite() const {
  bool all = std::isfinite(acceleration()) && std::isfinite(reaction()) && std::isfinite(kinetic_energy()) &&
             std::isfinite(potential_energy()) && std::isfinite(contact_energy());
  for (double value : flat(impl_->state)) all = all && std::isfinite(value);
  return all;
}

void Spring::observe(const Inputs& inputs) {
  check(inputs);
  see(impl_->state, Loads::from(impl_->parameters, inputs), 0.0);
}

void Spring::apply_impulse(double impulse) {
  if (!std::isfinite(impulse)) throw std::invalid_argument("spring: impulse = " + number(impulse) + ": must be finite");
  impl_->state.z += impulse / impl_->parameters.mass;
  if (impl_->state.z != 0.0) impl_->state.seated = 0.0;
}

double Spring::displacement() const { return impl_->state.y; }
double Spring::velocity() const { return impl_->state.z; }
double Spring::acceleration() const {
  const State& s = impl_->state;
  return seated() ? 0.0 : impl_->motion.acceleration(s.y, s.z, s.force, impl_->contact(s));
}
double Spring::displacement_integral() const { return impl_->state.integral; }
double Spring::displacement_integral_2() const { return impl_->state.integral_2; }
double Spring::reaction() const { return impl_->contact(impl_->state); }
Quadratic Spring::tip() const { return {impl_->state.tip, impl_->state.tip_rate, 0.0}; }
double Spring::stop_force() const { return impl_->state.stop_force; }
double Spring::stop_impulse() const { return impl_->state.stop_impulse; }
double Spring::kinetic_energy() const { return impl_->parameters.mass / 2 * impl_->state.z * impl_->state.z; }
double Spring::potential_energy() const { return impl_->motion.potential_energy(impl_->state.y); }
double Spring::contact_energy() const {
  return impl_->laws.compliance ? impl_->motion.compliance().energy(impl_->depth(impl_->state)) : 0.0;
}
double Spring::dissipated_energy() const { return impl_->state.dissipated; }
double Spring::load_work() const { return impl_->state.load_work; }
double Spring::impact_loss() const { return impl_->state.impact_loss; }
bool Spring::seated() const { return impl_->state.seated != 0.0; }
long Spring::ida_steps() const { return static_cast<long>(impl_->state.steps); }

void Spring::save(std::vector<double>& state) const {
  const auto numbers = flat(impl_->state);
  state.assign(numbers.begin(), numbers.end());
}

void Spring::restore(const std::vector<double>& state) {
  if (state.size() != Flat<State>{}.size())
    throw std::invalid_argument("spring: a saved state has " + std::to_string(Flat<State>{}.size()) + " numbers, not " +
                                std::to_string(state.size()));
  for (double value : state)
    if (!std::isfinite(value))
      throw std::invalid_argument("spring: a saved state holds " + number(value) + ": must be finite");
  const auto restored = from_flat<State>(state.data());
  if (!(restored.steps >= 0.0 && restored.steps < 0x1p53))
    throw std::invalid_argument("spring: a saved state counts " + number(restored.steps) + " internal steps");
  impl_->state = restored;
}

}  // namespace spring
