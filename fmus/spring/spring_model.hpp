// The spring behind the FMU's variables: spring::Spring and, where a contact force is held over steps, what finds it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "../../src_spring/held_contact.hpp"
#include "../../src_spring/parameters.hpp"
#include "../../src_spring/spring.hpp"
#include "../../src_spring/trial_steps.hpp"
#include "../../src_spring/wiring.hpp"
#include "../adapter/flat.hpp"
#include "../adapter/learnt_step.hpp"
#include "../adapter/model.hpp"

/// The spring's parameters and where its top rests.
struct FmuParameters : spring::Parameters {
  double equilibrium = 0.0;  ///< Ψ [m]: for the partner; it plays no part in the motion
  double gravity = 0.0;      ///< [m/s²]
};

class SpringModel final : public fmi::Model {
 public:
  FmuParameters parameters;

  // As set.
  spring::Inputs inputs;  ///< but for the tip
  double impulse = 0.0;
  fmi::Polynomial tip_displacement{}, tip_velocity{}, forecast{}, response{}, response_2{};
  bool extrapolated = false;         ///< tip_displacement has not been set since the last step
  bool tip_velocity_is_set = false;  ///< since the last step

  void build(double tolerance) override {
    FmuParameters p = parameters;
    if (tolerance > 0.0) p.relative_tolerance = std::min(p.relative_tolerance, tolerance);
    spring_.emplace(p);  // checks the parameters
    trials_.emplace(*spring_);
    held_.emplace(spring::contact_of(p), p.mass);
    rhythm_ = {};
    extrapolated = false;
  }

  void evaluate(Acting acting) override {
    if (acting == Acting::as_stepped) return;
    hold();
    observe();
  }

  fmi::Reached step(double time, double size, bool to_event) override {
    using Remedy = fmi::Discarded::Remedy;
    const State before = state();
    fmi::Reached reached{size, false};
    const Remedy remedy = std::isfinite(held_->force()) ? Remedy::other_size : Remedy::none;
    try {
      if (impulse != 0.0) spring_->apply_impulse(impulse);
      if (held()) {
        step_held(time, size);
      } else {
        spring::Inputs present = acting();
        present.tip_displacement = tip();
        reached = spring_->step_to_event(size, present, time, to_event);
      }
    } catch (const spring::StepFailure& e) {
      restore(before);
      throw fmi::Discarded(e.what(), remedy);
    }
    rhythm_ = {fmi::learnt_step(rhythm_.size, time, reached.size), 1.0};
    check_wiring();
    return reached;
  }

  void update(double time) override {
    if (impulse != 0.0) spring_->apply_impulse(impulse);
    if (parameters.stop_enabled) spring_->strike(time);
    observe();
  }

  void forget_what_was_set() override {
    extrapolated = true;
    tip_velocity_is_set = false;
  }
  void save(std::vector<double>& flat) const override { fmi::flatten(flat, state()); }
  void restore(const std::vector<double>& flat) override {
    State saved;
    fmi::restore(flat, saved);
    restore(saved);
  }

  const spring::Spring& body() const { return *spring_; }
  int warnings() const { return refused + wiring_.warnings(); }

  double reaction() const { return held() ? held_->force() : body().reaction(); }
  double elastic_reaction() const { return held() ? held_->elastic(body().displacement()) : body().elastic_reaction(); }
  double contact_energy() const {
    if (!held()) return body().contact_energy();
    return held_->energy(body().displacement(), extrapolated ? held_->state().tip : body().tip()[0]);
  }
  double dissipated_energy() const { return body().dissipated_energy() + held_->dissipated(); }

  // Rates of outputs, under the inputs that are set.
  double approach() const { return body().velocity() - (held() ? tip_velocity[0] : body().tip()[1]); }  ///< δ̇
  double reaction_rate() const {
    const auto slopes = body().reaction_slopes();
    return slopes.force_by_depth * approach() + slopes.force_by_rate * (body().acceleration() - body().tip()[2]);
  }

  double dissipated_power() const {
    const double by_contact = held() ? 0.0 : (body().reaction() - body().elastic_reaction()) * approach();
    return parameters.damping * body().velocity() * body().velocity() + by_contact;
  }

  double kinetic_power() const { return parameters.mass * body().velocity() * body().acceleration(); }
  double potential_power() const { return body().spring_force() * body().velocity(); }
  double contact_power() const { return elastic_reaction() * approach(); }
  double load_power() const { return spring::load_of(parameters, acting())[0] * body().velocity(); }
  double jerk() const {
    return body().jerk(spring::Loads::from(parameters, acting()).force[1], held() ? 0.0 : reaction_rate());
  }

 private:
  /// What is known of the steps: the size that is expected [s], and whether there was one.
  struct Rhythm {
    double size = fmi::default_step, stepped = 0.0;
  };
  struct State {
    spring::Spring::State top;
    double extrapolated;
    spring::HeldContact::State contact;  ///< all 0 where no force is held
    Rhythm rhythm;
  };
  State state() const { return {spring_->state(), extrapolated ? 1.0 : 0.0, held_->state(), rhythm_}; }
  void restore(const State& state) {
    spring_->restore(state.top);
    extrapolated = state.extrapolated != 0.0;
    tip_velocity_is_set = false;  // what was observed of it is part of the state
    held_->restore(state.contact);
    rhythm_ = state.rhythm;
    choose_law();
  }

  /// Whether the contact force is held over steps: the beam says how its tip answers it. Otherwise the law acts within
  /// the steps, on the extrapolated tip.
  bool held() const { return held_->held(); }
  void choose_law() { spring_->set_contact_law(held() ? spring::ContactLaw::external : parameters.contact_law); }
  /// Follow the message before the first step. One that comes later finds the force of its step sent.
  void hold() {
    const spring::TipMessage arrived = message();
    if (!parameters.compliant() || held_->started()) return;
    if (rhythm_.stepped != 0.0) {
      if (held() || !arrived.predicts()) return;
      held_->take_over(body().tip()[0], rhythm_.size, body().displacement(), body().reaction());
      if (body().displacement() > arrived.displacement) wiring_.count(spring::Wiring::no_first_exchange);
    } else if (arrived.predicts()) {
      spring_->set_contact_law(spring::ContactLaw::external);
      held_->begin(arrived, rhythm_.size, body().displacement(), trials(rhythm_.size));
    } else {
      held_->restore({});
    }
    choose_law();
  }

  /// What acts, but for the tip.
  spring::Inputs acting() const {
    spring::Inputs present = inputs;
    present.external_force[0] -= parameters.mass * parameters.gravity;
    if (parameters.compliant())
      present.contact_force = {held() && std::isfinite(held_->force()) ? held_->force() : 0.0, 0.0, 0.0};
    return present;
  }

  /// The tip from now on: tip_velocity is its rate where tip_displacement has no derivative, or one of 0.
  fmi::Polynomial tip() const {
    const auto& [u, rate, curvature] = tip_displacement;
    if (rate == 0.0) return {u, tip_velocity[0], curvature != 0.0 ? curvature : tip_velocity[1]};
    return tip_displacement;
  }

  spring::TipMessage message() const {
    return {tip_displacement[0], tip_velocity[0], forecast[0], response[0], response_2[0]};
  }
  /// To what outputs refer:
  ///     set since the last step    the tip is                   its rates are
  ///     tip_displacement           as set                       as set
  ///     tip_velocity alone         where the step has left it   as set
  ///     neither                    where the step has left it   those that the step has left
  void observe() {
    spring::Inputs present = acting();
    present.tip_displacement = extrapolated ? body().tip() : tip();
    if (extrapolated && tip_velocity_is_set)
      present.tip_displacement = {body().tip()[0], tip_velocity[0], tip_velocity[1]};
    spring_->observe(present);
  }

  void step_held(double time, double size) {
    const double expected = fmi::learnt_step(rhythm_.size, time, size);
    const double rounding = 64.0 * std::numeric_limits<double>::epsilon() * std::abs(time);  // of the importer's times
    require_held_force();
    if (std::abs(size - expected) <= rounding) size = expected;
    if (!trials_->adopt(size, acting())) spring_->step(size, acting(), time);
    if (!fmi::is_rest(expected, time, size)) {  // else the force is held on
      wiring_.check_step(*held_, message());
      held_->advance(message(), expected, body().displacement(), trials(expected));
      require_held_force();
    }
    forget_what_was_set();
    observe();
  }

  /// Where the top would be after the next step, of `size`, other inputs staying as they are.
  spring::HeldContact::Top trials(double size) {
    spring::Inputs next = acting();
    for (auto* input : {&next.foundation_force, &next.external_force, &next.base_acceleration})
      (*input)[1] = (*input)[2] = 0.0;
    trials_->begin(size, next);
    return [this](double force) { return trials_->displacement_under(force); };
  }

  void require_held_force() const {
    if (std::isfinite(held_->force())) return;
    const std::string& failure = trials_->failure();
    throw spring::StepFailure(
        "spring: no contact force was found that holds over the step: the tip is too far or too fast, or the step too "
        "long" +
        (failure.empty() ? "" : " (a trial step says: " + failure + ")"));
  }

  void check_wiring() {
    const spring::TipMessage m = message();
    const bool arrives = m.displacement != 0.0 || m.velocity != 0.0 || m.forecast != 0.0 || m.predicts();
    const double stiffness = body().reaction_slopes().force_by_depth;
    if (!parameters.compliant() && arrives) wiring_.count(spring::Wiring::no_law);
    if (m.forecast != 0.0 && stiffness > 0.0) wiring_.check_resolved(rhythm_.size, stiffness, parameters.mass);
    if (!wiring_.news.empty()) warning = std::exchange(wiring_.news, {});
  }

  std::optional<spring::Spring> spring_;
  std::optional<spring::TrialSteps> trials_;
  std::optional<spring::HeldContact> held_;
  Rhythm rhythm_;
  spring::Wiring wiring_;  ///< no part of the state
};
