// The spring FMU: its table of variables, bound to spring::Spring.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "../../src_spring/compliance.hpp"
#include "../../src_spring/held_contact.hpp"
#include "../../src_spring/parameters.hpp"
#include "../../src_spring/spring.hpp"
#include "../adapter/flat.hpp"
#include "../adapter/table.hpp"
#include "../adapter/text.hpp"

namespace {

using spring::HeldContact;
using spring::Parameters;
using spring::Spring;

/// The spring's parameters, where its top rests, and what exchange between steps adds to them.
struct FmuParameters : Parameters {
  double equilibrium = 0.0;  ///< Ψ [m]: for the partner; it plays no part in the motion
  double gravity = 0.0;      ///< [m/s²]
  double communication_step = 0.0, tip_response = 0.0, tip_response_2 = 0.0;
};

struct SpringModel final : fmi::Model {
  FmuParameters parameters;
  spring::Inputs inputs;  ///< but for the tip
  fmi::Polynomial tip_velocity{}, forecast{};
  fmi::Polynomial tip_displacement{};                    ///< as set
  bool tip_is_set = false, tip_velocity_is_set = false;  ///< since the last observe()
  double impulse = 0.0;
  mutable std::optional<Spring> spring;  ///< which trial steps leave as it was
  std::optional<HeldContact> held;

  void build(double tolerance) override {
    FmuParameters p = parameters;
    if (tolerance > 0.0) p.relative_tolerance = std::min(p.relative_tolerance, tolerance);
    held.reset();
    const bool holds = p.compliant() && p.communication_step > 0.0;
    if (holds) p.contact_law = spring::ContactLaw::external;
    spring.emplace(p);  // checks the parameters
    const spring::Compliance law(p.compliance_stiffness, p.compliance_exponent, p.compliance_damping);
    if (holds) held.emplace(law, p.mass, p.communication_step, std::array{p.tip_response, p.tip_response_2});
  }

  void evaluate(Acting acting) override {
    if (acting == Acting::as_stepped) return;
    const bool initial = acting == Acting::at_start;
    if (held && !held->started()) held->begin(message(), initial, spring->displacement(), trial());
    look();
  }

  Reached step(double time, double size, bool to_event) override {
    using Remedy = fmi::Discarded::Remedy;
    // Tools that add up their times end with a step that is nothing but rounding: the force is held over it too.
    const double late = 64.0 * std::numeric_limits<double>::epsilon() * std::abs(time);  // t itself is rounded
    const double rounded = held ? rounding * held->size() + late : 0.0;
    const bool goes_on = held && size > rounded;
    if (goes_on && std::abs(size - held->size()) > rounded) {
      throw fmi::Discarded("a step of " + fmi::number(size) + " s, but communication_step = " +
                               fmi::number(held->size()) + " s: steps must have that size, or the parameter be 0",
                           Remedy::none);
    }
    if (!has_force()) throw fmi::Discarded(no_force(), Remedy::none);
    std::vector<double> before;
    if (impulse != 0.0 || held) save(before);
    spring::Inputs present = acting();
    present.tip_displacement = tip();
    Reached reached{};
    try {
      if (impulse != 0.0) spring->apply_impulse(impulse);
      // A held force asks for steps of one size.
      const Spring::Reached came = spring->step_to_event(size, present, time, to_event && !held);
      reached = {came.size, came.event};
      if (goes_on) held->advance(message(), spring->displacement(), trial());
      if (!has_force()) throw spring::StepFailure(no_force(), 0.0);
    } catch (const spring::StepFailure& e) {
      if (!before.empty()) restore(before);
      throw fmi::Discarded(e.what(), held ? Remedy::none : Remedy::other_size);
    }
    if (held) look();
    check_wiring();
    return reached;
  }

  void update(double time) override {
    if (impulse != 0.0) spring->apply_impulse(impulse);
    if (parameters.stop_enabled) spring->strike(time);
    look();
  }

  void settle() override { tip_is_set = tip_velocity_is_set = false; }

  double reaction() const { return held ? held->force() : spring->reaction(); }
  double contact_energy() const { return held ? held->energy(spring->displacement()) : spring->contact_energy(); }
  double dissipated_energy() const { return spring->dissipated_energy() + (held ? held->dissipated() : 0.0); }

  // Rates of outputs, under the inputs that are set.
  double approach() const { return spring->velocity() - (held ? tip_velocity[0] : spring->tip()[1]); }  ///< δ̇
  double reaction_rate() const {
    const auto slopes = spring->reaction_slopes();
    return slopes.force_by_depth * approach() + slopes.force_by_rate * (spring->acceleration() - spring->tip()[2]);
  }
  double dissipated_power() const {
    const double by_contact = held ? 0.0 : (spring->reaction() - spring->elastic_reaction()) * approach();
    return parameters.damping * spring->velocity() * spring->velocity() + by_contact;
  }
  double kinetic_power() const { return parameters.mass * spring->velocity() * spring->acceleration(); }
  double load_power() const { return spring::load_of(parameters, acting())[0] * spring->velocity(); }
  double jerk() const {
    return spring->jerk(spring::Loads::from(parameters, acting()).force[1], held ? 0.0 : reaction_rate());
  }
  /// Per newton of an upward force that does not change C.
  double mobility() const { return spring->seated() ? 0.0 : 1.0 / parameters.mass; }
  double contact_power() const { return elastic_reaction() * approach(); }
  double elastic_reaction() const { return held ? held->elastic(spring->displacement()) : spring->elastic_reaction(); }

  /// Not known, so found by differences, where the held force follows an input: before its first step.
  double held_force_by_input() const {
    return held && !held->started() ? std::numeric_limits<double>::quiet_NaN() : 0.0;
  }
  double reaction_by_tip_displacement() const {
    return held ? held_force_by_input() : -spring->reaction_slopes().force_by_depth;
  }
  double reaction_by_tip_velocity() const {
    return tip_displacement[1] != 0.0 ? 0.0 : -spring->reaction_slopes().force_by_rate;
  }
  double reaction_by_tip_rate() const {
    return tip_displacement[1] != 0.0 ? -spring->reaction_slopes().force_by_rate : 0.0;
  }
  double contact_energy_by_tip_displacement() const { return held && held->started() ? 0.0 : -elastic_reaction(); }

  int warnings() const {
    int count = refused;
    for (std::size_t i = 0; i < faults.size(); ++i)
      if (showed_[i] >= faults[i].most) count += showed_[i];
    return count;
  }

  void save(std::vector<double>& state) const override {
    if (held)
      fmi::flatten(state, spring->state(), held->state());
    else
      fmi::flatten(state, spring->state());
  }

  void restore(const std::vector<double>& state) override {
    Spring::State top = spring->state();
    if (held) {
      HeldContact::State contact = held->state();
      fmi::restore(state, top, contact);
      held->restore(contact);
    } else {
      fmi::restore(state, top);
    }
    spring->restore(top);
    settle();  // what was seen of the inputs is part of the state
  }

 private:
  static constexpr double most_trial_work = 250'000.0;  ///< internal steps for one force, as for one step
  static constexpr double rounding = 1e-6;              ///< of communication_step
  /// A pair that is wired wrongly gains or loses energy, or has no contact, without a sign. After `most` steps in which
  /// that shows it is sure: a sudden load makes the tip miss in 2, a harmonic one from rest in up to 8.
  struct Fault {
    int most;
    const char* text;
  };
  static constexpr std::array<Fault, HeldContact::kinds + 2> faults{
      {{10,
        "the tip was not where it was foreseen, so the contact gains or loses energy. Connect tip_displacement and "
        "tip_velocity_forecast of the beam to the inputs of these names and reaction to its tip_force; set "
        "communication_step in both to the step size, tip_response and tip_response_2 to the beam's. Loads on the beam "
        "that change much within a step show here, too"},
       {3,
        "the tip was not where it was foreseen, but where one step more or less takes it: pass values on between the "
        "steps only, for both FMUs alike (Jacobi), or delay what passes within a step by one step"},
       {3, "the tip was not where it was foreseen: tip_response and tip_response_2 are swapped"},
       {1,
        "nothing was passed on before the first step (or a blow hit the beam): the tip made it without a contact "
        "force, which adds energy. Exchange values before the first step, too"},
       {1,
        "the beam's tip arrives or communication_step is set, but contact_law = 1: there is no contact. Set "
        "contact_law = 2, or connect only contact_force"},
       {1,
        "tip_velocity_forecast arrives but is not used, as communication_step = 0: a contact that the steps do not "
        "resolve gains energy. Set communication_step, tip_response and tip_response_2 to those of the beam, or "
        "communication_step of the beam to 0"}}};

  std::array<int, faults.size()> showed_{};  ///< steps so far; no part of the state
  std::array<bool, faults.size()> told_{};
  mutable std::string trial_failure_;

  /// The tip from now on: tip_velocity is its rate where tip_displacement has no derivative, or one of 0.
  fmi::Polynomial tip() const {
    const auto& [u, rate, curvature] = tip_displacement;
    if (rate == 0.0) return {u, tip_velocity[0], curvature != 0.0 ? curvature : tip_velocity[1]};
    return tip_displacement;
  }

  /// What acts, but for the tip.
  spring::Inputs acting() const {
    spring::Inputs present = inputs;
    present.external_force[0] -= parameters.mass * parameters.gravity;
    if (parameters.compliant()) present.contact_force = {held && has_force() ? held->force() : 0.0, 0.0, 0.0};
    return present;
  }

  /// To what outputs refer to. A tip that was not set since the last step is where that one left it.
  void look() {
    spring::Inputs present = acting();
    const bool extrapolated = spring->extrapolated() && !tip_is_set;
    present.tip_displacement = extrapolated ? spring->tip() : tip();
    if (extrapolated && tip_velocity_is_set)
      present.tip_displacement = {spring->tip()[0], tip_velocity[0], tip_velocity[1]};
    settle();
    spring->observe(present, extrapolated);
  }

  bool has_force() const { return !held || (std::isfinite(held->force()) && std::isfinite(contact_energy())); }
  std::string no_force() const {
    return "spring: no contact force was found that holds over the step: the tip is too far or too fast, or the step "
           "too long" +
           (trial_failure_.empty() ? "" : " (a trial step says: " + trial_failure_ + ")");
  }

  void check_wiring() {
    const bool law = parameters.compliant(), ahead = parameters.communication_step > 0.0 || forecast[0] != 0.0;
    const bool arrives = ahead || tip_displacement[0] != 0.0 || tip_velocity[0] != 0.0;
    if (held) std::copy(held->missed().begin(), held->missed().end(), showed_.begin());
    showed_[HeldContact::kinds] += !law && arrives ? 1 : 0;
    showed_[HeldContact::kinds + 1] += law && !held && ahead ? 1 : 0;
    for (std::size_t i = 0; i < faults.size(); ++i) {
      if (showed_[i] < faults[i].most || std::exchange(told_[i], true)) continue;
      warning = faults[i].text;
    }
  }

  spring::TipMessage message() const { return {tip_displacement[0], forecast[0]}; }

  /// Where the top would be after the next step, other inputs staying as they are; the spring is left as it was.
  HeldContact::Top trial() const {
    const Spring::State start = spring->state();
    spring::Inputs next = acting();
    for (auto* input : {&next.foundation_force, &next.external_force, &next.base_acceleration})
      (*input)[1] = (*input)[2] = 0.0;
    trial_failure_.clear();
    return [this, start, next, work = 0.0](double force) mutable {
      constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
      if (work > most_trial_work) return unknown;
      next.contact_force = {force, 0.0, 0.0};
      const double before = spring->internal_steps();
      double reached = unknown;
      try {
        spring->step(held->size(), next);
        reached = spring->displacement();
      } catch (const spring::StepFailure& e) {
        trial_failure_ = e.what();
      }
      work += spring->internal_steps() - before;
      spring->restore(start);
      return reached;
    };
  }
};

template <class Value>
auto of(Value (Spring::*value)() const) {
  return [value](const SpringModel& m) { return ((*m.spring).*value)(); };
}

}  // namespace

fmi::Table fmi::make_table() {
  fmi::Table t;
  t.identifier = "spring";
  t.title = "DuffingSpring";
  t.description =
      "Duffing spring m y'' + alpha_s y' + k1 x + k2 x^3 = -C + N + f_s, x = y - unloaded, under a contact force C, "
      "above a rigid foundation";
  t.stop_time = 0.6;
  t.step_size = 1e-3;
  t.ends_steps_early = true;
  t.choices.push_back({"ContactLaw",
                       "where the contact force comes from",
                       {"external, the input contact_force",
                        "normal_compliance, computed inside from tip_displacement and tip_velocity"}});

  fmi::TableBuilder<SpringModel> add(t);
  const auto parameter = [&](const char* name, const char* unit, auto field, const char* text) -> fmi::Variable& {
    return add.parameter(name, unit, &SpringModel::parameters, field, text);
  };
  parameter("mass", "kg", &Parameters::mass, "mass m").positive();
  parameter("damping", "N.s/m", &Parameters::damping, "viscous damping alpha_s").at_least(0);
  parameter("linear_stiffness", "N/m", &Parameters::linear_stiffness, "linear stiffness k1");
  parameter("cubic_stiffness", "N/m3", &Parameters::cubic_stiffness, "cubic stiffness k2; < 0 softens");
  parameter("unloaded", "m", &Parameters::unloaded,
            "position of the top where the spring is without force: the force is k1 x + k2 x^3, x = y - unloaded");
  parameter(
      "equilibrium", "m", &FmuParameters::equilibrium,
      "position Psi of the top at the start, for whoever reads the parameters: the motion begins at the start value of "
      "displacement, and the spring is without force at unloaded");
  parameter("gravity", "m/s2", &FmuParameters::gravity,
            "acceleration of gravity g, downward: a force of -mass*g, part of external_force in load_work");
  parameter("contact_law", "", &Parameters::contact_law, "1 = external, 2 = normal compliance inside")
      .range(1, 2)
      .choice = "ContactLaw";
  parameter("compliance_stiffness", "", &Parameters::compliance_stiffness,
            "lambda in C = lambda*max(0, d)^p*max(0, 1 + chi*d') [N/m^p], d = y - u_tip")
      .at_least(0)
      .typical(1e4);
  parameter("compliance_exponent", "", &Parameters::compliance_exponent, "exponent p in the contact law").range(1, 100);
  parameter("compliance_damping", "s/m", &Parameters::compliance_damping,
            "damping chi of the contact law (Hunt and Crossley); what it takes is in dissipated_energy")
      .at_least(0);
  parameter(
      "communication_step", "s", &FmuParameters::communication_step,
      "for contact_law = 2 beside a beam with the same communication_step: size of all communication steps. If > 0, "
      "reaction is held over each step at the value that does the law's work, the tip being foreseen: no energy is "
      "gained at any step size. 0: the law under the extrapolated tip")
      .at_least(0)
      .typical(1e-3);
  parameter("tip_response", "m/N", &FmuParameters::tip_response, "for communication_step > 0: tip_response of the beam")
      .at_least(0);
  parameter("tip_response_2", "m/N", &FmuParameters::tip_response_2,
            "for communication_step > 0: tip_response_2 of the beam");
  parameter("stop_enabled", "", &Parameters::stop_enabled, "foundation inside, with impacts");
  parameter("stop_position", "m", &Parameters::stop_position, "position phi of the foundation");
  parameter("restitution", "", &Parameters::restitution, "coefficient of restitution at the foundation").range(0, 1);
  parameter("relative_tolerance", "", &Parameters::relative_tolerance,
            "relative tolerance of the motion; an importer's tolerance can tighten, never loosen it")
      .range(std::numeric_limits<double>::min(), 1e-2)
      .typical(1e-12);
  parameter("absolute_tolerance", "", &Parameters::absolute_tolerance, "absolute tolerance of the motion")
      .range(std::numeric_limits<double>::min(), 1e-2)
      .typical(1e-14);

  const auto input = [&](const char* name, const char* unit, fmi::Polynomial spring::Inputs::*field, const char* text) {
    add.input(name, unit, text, [field](SpringModel& m, const fmi::Polynomial& value) { m.inputs.*field = value; });
  };
  input("contact_force", "N", &spring::Inputs::contact_force,
        "contact force C, positive presses the spring down; its derivatives of order 1 and 2 hold for the next step "
        "only: C(tau) = C + C' tau + C'' tau^2/2; ignored when contact_law = 2");
  input("foundation_force", "N", &spring::Inputs::foundation_force,
        "foundation force N, positive upward; derivatives as for contact_force; ignored when stop_enabled");
  add.impulse("impulse", "N.s", "upward impulse, applied at the start of the next step, then 0 again",
              &SpringModel::impulse);
  input("external_force", "N", &spring::Inputs::external_force,
        "external force f_s, positive upward; derivatives as for contact_force");
  input("base_acceleration", "m/s2", &spring::Inputs::base_acceleration,
        "acceleration a of the foundation, upward; all displacements are relative to it, so that it acts as a force of "
        "-mass*a; derivatives as for contact_force");
  add.input("tip_displacement", "m",
            "displacement of the beam's tip, read by contact_law = 2; extrapolated over the step by its derivatives or "
            "else by tip_velocity",
            &SpringModel::tip_displacement)
      .set = [](fmi::Model& m, const fmi::Polynomial& value) {
    auto& model = static_cast<SpringModel&>(m);
    model.tip_displacement = value;
    model.tip_is_set = true;
  };
  add.input("tip_velocity", "m/s",
            "velocity of the beam's tip, read by contact_law = 2 where the derivative of tip_displacement is 0; its "
            "derivative of order 1 is the tip's acceleration, that of order 2 is not used",
            [](SpringModel& m, const fmi::Polynomial& value) {
              m.tip_velocity = value;
              m.tip_velocity_is_set = true;
            });
  add.input("tip_velocity_forecast", "m/s",
            "for communication_step > 0: tip_velocity_forecast of the beam; its derivatives are not used",
            &SpringModel::forecast);

  add.output("displacement", "m", "position y of the top", of(&Spring::displacement), of(&Spring::velocity));
  add.exact_start(&SpringModel::parameters, &FmuParameters::displacement);
  add.output("velocity", "m/s", "velocity z of the top", of(&Spring::velocity), of(&Spring::acceleration));
  add.exact_start(&SpringModel::parameters, &FmuParameters::velocity);
  const std::vector<std::string> motion{"contact_law", "compliance_stiffness", "compliance_exponent",
                                        "compliance_damping", "displacement", "tip_displacement", "tip_velocity",
                                        // with communication_step > 0, of which the first is foreseen:
                                        "communication_step", "tip_response", "tip_velocity_forecast", "velocity",
                                        "mass", "damping", "linear_stiffness", "cubic_stiffness", "unloaded",
                                        "external_force", "base_acceleration", "foundation_force", "stop_enabled",
                                        "stop_position", "restitution", "gravity"};
  using M = const SpringModel&;
  add.output("displacement_integral", "m.s", "integral of displacement over the last step",
             of(&Spring::displacement_integral), of(&Spring::displacement));
  add.output("displacement_integral_2", "m.s2", "double integral of displacement over the last step",
             of(&Spring::displacement_integral_2), of(&Spring::displacement_integral));
  add.output(
         "reaction", "N", "contact force of the law inside, 0 when contact_law = 1",
         [](const SpringModel& m) { return m.reaction(); }, [](const SpringModel& m) { return m.reaction_rate(); })
      .from(motion);
  // What changes force and contact force at once: by an input, or by its derivative of that order.
  struct Influence {
    const char* input;
    double (*partial)(M);
    int order = 0;
  };
  const auto by_held = [](M m) { return m.held_force_by_input(); };
  const Influence loads[] = {{"foundation_force", [](M m) { return m.parameters.stop_enabled ? 0.0 : 1.0; }},
                             {"external_force", [](M) { return 1.0; }},
                             {"base_acceleration", [](M m) { return -m.parameters.mass; }}};
  const Influence contact[] = {{"tip_displacement", [](M m) { return m.reaction_by_tip_displacement(); }},
                               {"tip_displacement", [](M m) { return m.reaction_by_tip_rate(); }, 1},
                               {"tip_velocity", [](M m) { return m.reaction_by_tip_velocity(); }},
                               {"tip_velocity_forecast", by_held}};
  for (const auto& [name, partial, order] : contact) add.depends(name, partial, order);
  for (const auto& [name, partial, order] : loads)
    add.depends(name, [=, by = partial](M m) { return by(m) * by_held(m); });
  add.output("acceleration", "m/s2", "acceleration of the top", of(&Spring::acceleration), [](M m) { return m.jerk(); })
      .from(motion);
  t.variables.back().initial_dependencies->emplace_back("contact_force");
  add.depends("contact_force", [](M m) { return m.parameters.compliant() ? 0.0 : -m.mobility(); });
  for (const auto& [name, partial, order] : contact)
    add.depends(name, [by = partial](M m) { return -m.mobility() * by(m); }, order);
  for (const auto& [name, partial, order] : loads)
    add.depends(name, [=, by = partial](M m) { return m.mobility() * by(m) * (1.0 - by_held(m)); });
  add.output("seated", "", "1 while the top rests on the foundation inside, otherwise 0", of(&Spring::seated))
      .steps_only();
  add.output("number_of_impacts", "", "impacts on the foundation inside since the start", of(&Spring::impacts))
      .steps_only();
  add.output("last_impact_time", "s", "time of the last of them; -1 if there was none", of(&Spring::last_impact));
  add.output("stop_force", "N", "mean foundation force of the law inside over the last step", of(&Spring::stop_force));
  add.output("stop_impulse", "N.s", "sum of the foundation's impulses over the last step", of(&Spring::stop_impulse));
  add.output("kinetic_energy", "J", "kinetic energy", of(&Spring::kinetic_energy),
             [](M m) { return m.kinetic_power(); })
      .from({"mass", "velocity"});
  add.output("potential_energy", "J", "potential energy of the spring", of(&Spring::potential_energy),
             [](M m) { return m.spring->spring_force() * m.spring->velocity(); })
      .from({"linear_stiffness", "cubic_stiffness", "unloaded", "displacement"});
  add.output(
         "contact_energy", "J", "energy stored in the contact law inside", [](M m) { return m.contact_energy(); },
         [](M m) { return m.contact_power(); })
      .from({"contact_law", "compliance_stiffness", "compliance_exponent", "displacement", "tip_displacement"});
  add.depends("tip_displacement", [](M m) { return m.contact_energy_by_tip_displacement(); });
  add.output(
      "dissipated_energy", "J", "work of the damping force and of the contact's damping since the start",
      [](M m) { return m.dissipated_energy(); }, [](M m) { return m.dissipated_power(); });
  add.output("load_work", "J",
             "work of external_force and base_acceleration since the start, where it is 0, impacts and rest on the "
             "foundation inside included",
             of(&Spring::load_work), [](M m) { return m.load_power(); });
  add.local("impact_loss", "J", "energy lost in impacts on the foundation inside since the start",
            of(&Spring::impact_loss));
  add.output(
         "warnings", "",
         "steps so far in which something was missed or refused: the wiring is wrong, or a step was discarded. Many "
         "tools hide the messages that say what; restored states do not take it back",
         [](M m) { return m.warnings(); })
      .steps_only();
  add.local("internal_steps", "",
            "internal steps since the start: parts with a Taylor series of their own, and steps of IDA",
            of(&Spring::internal_steps));
  return t;
}

std::unique_ptr<fmi::Model> fmi::make_model() { return std::make_unique<SpringModel>(); }
