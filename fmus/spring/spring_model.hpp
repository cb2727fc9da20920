// The spring behind the FMU's variables: spring::Spring and, where a contact force is held over steps, what finds it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "../../src_spring/held_contact.hpp"
#include "../../src_spring/parameters.hpp"
#include "../../src_spring/spring.hpp"
#include "../../src_spring/trial_steps.hpp"
#include "../../src_spring/wiring.hpp"
#include "../adapter/flat.hpp"
#include "../adapter/model.hpp"
#include "../adapter/text.hpp"

/// The spring's parameters, where its top rests, and what exchange between steps adds to them.
struct FmuParameters : spring::Parameters {
  double equilibrium = 0.0;  ///< Ψ [m]: for the partner; it plays no part in the motion
  double gravity = 0.0;      ///< [m/s²]
  double communication_step = 0.0, tip_response = 0.0, tip_response_2 = 0.0;
};

class SpringModel final : public fmi::Model {
 public:
  FmuParameters parameters;

  // As set.
  spring::Inputs inputs;  ///< but for the tip
  double impulse = 0.0;
  fmi::Polynomial tip_displacement{}, tip_velocity{}, forecast{};
  bool tip_is_set = false, tip_velocity_is_set = false;  ///< since the last step

  void build(double tolerance) override {
    FmuParameters p = parameters;
    if (tolerance > 0.0) p.relative_tolerance = std::min(p.relative_tolerance, tolerance);
    const bool holds = p.compliant() && p.communication_step > 0.0;
    if (holds) p.contact_law = spring::ContactLaw::external;
    held_.reset();
    spring_.emplace(p);  // checks the parameters
    trials_.emplace(*spring_);
    const spring::Compliance law(p.compliance_stiffness, p.compliance_exponent, p.compliance_damping);
    if (holds) held_.emplace(law, p.mass, p.communication_step, std::array{p.tip_response, p.tip_response_2});
  }

  void evaluate(Acting acting) override {
    if (acting == Acting::as_stepped) return;
    if (held_ && !held_->started()) {
      held_->begin(message(), acting == Acting::at_start, top().displacement(), trials());
      wiring_.check_start(*held_, message());
    }
    observe();
  }

  Reached step(double time, double size, bool to_event) override {
    using Remedy = fmi::Discarded::Remedy;
    const State before = state();
    Reached reached{size, false};
    try {
      if (impulse != 0.0) spring_->apply_impulse(impulse);
      if (held_) {
        step_held(time, size);
      } else {
        spring::Inputs present = acting();
        present.tip_displacement = tip();
        const spring::Spring::Reached came = spring_->step_to_event(size, present, time, to_event);
        reached = {came.size, came.event};
      }
    } catch (const spring::StepFailure& e) {
      restore(before);
      throw fmi::Discarded(e.what(), held_ ? Remedy::none : Remedy::other_size);
    }
    check_wiring();
    return reached;
  }

  void update(double time) override {
    if (impulse != 0.0) spring_->apply_impulse(impulse);
    if (parameters.stop_enabled) spring_->strike(time);
    observe();
  }

  void forget_what_was_set() override { tip_is_set = tip_velocity_is_set = false; }
  void save(std::vector<double>& flat) const override { fmi::flatten(flat, state()); }
  void restore(const std::vector<double>& flat) override {
    State saved;
    fmi::restore(flat, saved);
    restore(saved);
    forget_what_was_set();  // what was observed of the inputs is part of the state
  }

  const spring::Spring& top() const { return *spring_; }
  int warnings() const { return refused + wiring_.warnings(); }

  double reaction() const { return held_ ? held_->force() : top().reaction(); }
  double elastic_reaction() const { return held_ ? held_->elastic(top().displacement()) : top().elastic_reaction(); }
  double contact_energy() const { return held_ ? held_->energy(top().displacement()) : top().contact_energy(); }
  double dissipated_energy() const { return top().dissipated_energy() + (held_ ? held_->dissipated() : 0.0); }

  // Rates of outputs, under the inputs that are set.
  double approach() const { return top().velocity() - (held_ ? tip_velocity[0] : top().tip()[1]); }  ///< δ̇
  double reaction_rate() const {
    const auto slopes = top().reaction_slopes();
    return slopes.force_by_depth * approach() + slopes.force_by_rate * (top().acceleration() - top().tip()[2]);
  }

  double dissipated_power() const {
    const double by_contact = held_ ? 0.0 : (top().reaction() - top().elastic_reaction()) * approach();
    return parameters.damping * top().velocity() * top().velocity() + by_contact;
  }

  double kinetic_power() const { return parameters.mass * top().velocity() * top().acceleration(); }
  double potential_power() const { return top().spring_force() * top().velocity(); }
  double contact_power() const { return elastic_reaction() * approach(); }
  double load_power() const { return spring::load_of(parameters, acting())[0] * top().velocity(); }
  double jerk() const {
    return top().jerk(spring::Loads::from(parameters, acting()).force[1], held_ ? 0.0 : reaction_rate());
  }

  // Derivatives of outputs.
  double mobility() const { return top().seated() ? 0.0 : 1.0 / parameters.mass; }  ///< of the top, by a force on it
  /// Not a number, so found by differences, where the held force follows an input: before its first step.
  double held_force_by_input() const {
    return held_ && !held_->started() ? std::numeric_limits<double>::quiet_NaN() : 0.0;
  }

  double reaction_by_tip_displacement() const {
    return held_ ? held_force_by_input() : -top().reaction_slopes().force_by_depth;
  }

  double reaction_by_tip_velocity() const {
    return tip_displacement[1] != 0.0 ? 0.0 : -top().reaction_slopes().force_by_rate;
  }

  /// By the derivative of tip_displacement
  double reaction_by_tip_rate() const {
    return tip_displacement[1] != 0.0 ? -top().reaction_slopes().force_by_rate : 0.0;
  }

  double contact_energy_by_tip_displacement() const { return held_ && held_->started() ? 0.0 : -elastic_reaction(); }

 private:
  struct State {
    spring::Spring::State top;
    spring::HeldContact::State contact;  ///< all 0 without one
  };
  State state() const { return {spring_->state(), held_ ? held_->state() : spring::HeldContact::State{}}; }
  void restore(const State& state) {
    spring_->restore(state.top);
    if (held_) held_->restore(state.contact);
  }

  /// What acts, but for the tip.
  spring::Inputs acting() const {
    spring::Inputs present = inputs;
    present.external_force[0] -= parameters.mass * parameters.gravity;
    if (parameters.compliant())
      present.contact_force = {held_ && std::isfinite(held_->force()) ? held_->force() : 0.0, 0.0, 0.0};
    return present;
  }

  /// The tip from now on: tip_velocity is its rate where tip_displacement has no derivative, or one of 0.
  fmi::Polynomial tip() const {
    const auto& [u, rate, curvature] = tip_displacement;
    if (rate == 0.0) return {u, tip_velocity[0], curvature != 0.0 ? curvature : tip_velocity[1]};
    return tip_displacement;
  }

  spring::TipMessage message() const { return {tip_displacement[0], forecast[0]}; }
  /// To what outputs refer. A tip that was not set since the last step is where that one left it.
  void observe() {
    spring::Inputs present = acting();
    const bool extrapolated = top().extrapolated() && !tip_is_set;
    present.tip_displacement = extrapolated ? top().tip() : tip();
    if (extrapolated && tip_velocity_is_set)
      present.tip_displacement = {top().tip()[0], tip_velocity[0], tip_velocity[1]};
    forget_what_was_set();
    spring_->observe(present, extrapolated);
  }

  /// A held force asks for steps of one size.
  void step_held(double time, double size) {
    constexpr double share = 1e-6;  // of the size, which sums of steps may lack, or be more than nothing
    const double H = held_->size(), difference = std::abs(size - H);
    const double of_time = 64.0 * std::numeric_limits<double>::epsilon() * std::abs(time);  // t itself is rounded
    const bool whole = size > share * H + of_time;
    if (whole && difference > share * H + of_time)
      throw spring::StepFailure("a step of " + fmi::number(size) + " s, but communication_step = " + fmi::number(H) +
                                    " s: steps must have that size, or the parameter be 0",
                                0.0);
    require_held_force();
    if (difference <= of_time) size = H;
    if (!trials_->adopt(size, acting())) spring_->step(size, acting(), time);
    if (whole) {  // else the force is held on
      wiring_.check_step(*held_, message());
      held_->advance(message(), top().displacement(), trials());
      require_held_force();
    }
    observe();
  }

  /// Where the top would be after the next step, other inputs staying as they are.
  spring::HeldContact::Top trials() {
    spring::Inputs next = acting();
    for (auto* input : {&next.foundation_force, &next.external_force, &next.base_acceleration})
      (*input)[1] = (*input)[2] = 0.0;
    trials_->begin(held_->size(), next);
    return [this](double force) { return trials_->displacement_under(force); };
  }

  void require_held_force() const {
    if (std::isfinite(held_->force())) return;
    const std::string& failure = trials_->failure();
    throw spring::StepFailure(
        "spring: no contact force was found that holds over the step: the tip is too far or too fast, or the step too "
        "long" +
            (failure.empty() ? "" : " (a trial step says: " + failure + ")"),
        0.0);
  }

  void check_wiring() {
    const bool law = parameters.compliant(), ahead = parameters.communication_step > 0.0 || forecast[0] != 0.0;
    const bool arrives = ahead || tip_displacement[0] != 0.0 || tip_velocity[0] != 0.0;
    if (!law && arrives) wiring_.count(spring::Wiring::no_law);
    if (law && !held_ && ahead) wiring_.count(spring::Wiring::forecast_not_used);
    if (const char* news = wiring_.news()) warning = news;
  }

  std::optional<spring::Spring> spring_;
  std::optional<spring::TrialSteps> trials_;
  std::optional<spring::HeldContact> held_;
  spring::Wiring wiring_;  ///< no part of the state
};
