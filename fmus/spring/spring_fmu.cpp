// The spring FMU: its table of variables, bound to spring::Spring.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "../../src_spring/compliance.hpp"
#include "../../src_spring/flat.hpp"
#include "../../src_spring/held_contact.hpp"
#include "../../src_spring/parameters.hpp"
#include "../../src_spring/spring.hpp"
#include "../adapter/table.hpp"
#include "../common/text.hpp"

namespace {

using spring::Parameters;
using spring::Spring;

/// The spring's parameters, where its top rests, and what exchange between steps adds to them.
struct FmuParameters : Parameters {
  double equilibrium = 0.0;  ///< Ψ [m]; in (6) the spring's force is 0 at y = 0 all the same
  double communication_step = 0.0, tip_response = 0.0, tip_response_2 = 0.0;
};

struct SpringModel final : fmi::Model {
  FmuParameters parameters;
  spring::Inputs inputs;  ///< but for the tip
  fmi::Polynomial tip_velocity{}, forecast{};
  fmi::Polynomial tip_displacement{0.0, fmi::unset, fmi::unset};  ///< as set
  std::optional<fmi::Polynomial> reached;  ///< what it was extrapolated to, until it is set or used again
  double impulse = 0.0;
  std::optional<Spring> spring;
  std::optional<spring::HeldContact> held;

  void build(double tolerance) override {
    Parameters p = parameters;
    // A start of 0 is what tools send that set every start value: it does not count as chosen.
    if (p.displacement == 0.0) p.displacement = parameters.equilibrium;
    if (tolerance > 0.0) p.relative_tolerance = std::min(p.relative_tolerance, tolerance);
    held.reset();
    if (p.compliant() && parameters.communication_step > 0.0) {
      p.contact_law = spring::ContactLaw::external;
      spring.emplace(p);  // checks the parameters
      held.emplace(spring::Compliance(p.compliance_stiffness, p.compliance_exponent, p.compliance_damping), p.mass,
                   parameters.communication_step,
                   std::array<double, 2>{parameters.tip_response, parameters.tip_response_2});
    } else {
      spring.emplace(p);
    }
  }

  void observe() override {
    if (held) {
      if (!held->started()) held->begin(message(), spring->displacement(), trial());
      show_force();
    } else {
      spring->observe(acting());
    }
  }

  void step(double size) override {
    reached.reset();
    // Tools that add up their times end with a step that is nothing but rounding: the force is held over it too.
    const bool goes_on = held && size > rounding * held->size();
    if (goes_on && std::abs(size - held->size()) > rounding * held->size()) {
      throw fmi::Discarded("a step of " + common::number(size) + " s, but communication_step = " +
                           common::number(held->size()) + " s: steps must have that size, or the parameter be 0");
    }
    std::vector<double> before;
    if (impulse != 0.0 || held) save(before);
    const auto discard = [&](const std::string& why) {
      if (!before.empty()) restore(before);
      throw fmi::Discarded(why);
    };
    const auto has_force = [this] {
      return !held || (std::isfinite(held->force()) && std::isfinite(contact_energy()));
    };
    if (!has_force()) discard(no_force);
    const spring::Inputs present = acting();
    try {
      if (impulse != 0.0) spring->apply_impulse(impulse);
      spring->step(size, present);
    } catch (const spring::StepFailure& e) {
      discard(e.what());
    } catch (const std::domain_error& e) {
      discard(e.what());
    }
    keep_tip();
    if (goes_on) held->advance(message(), spring->displacement(), trial());
    if (!has_force()) discard(no_force);
    if (held) show_force();
    check_wiring();
  }

  double reaction() const { return held ? held->force() : spring->reaction(); }
  double contact_energy() const { return held ? held->energy(spring->displacement()) : spring->contact_energy(); }
  double reaction_rate() const {
    const auto slopes = spring->reaction_slopes();
    return slopes.force_by_depth * (spring->velocity() - spring->tip()[1]) +
           slopes.force_by_rate * (spring->acceleration() - tip()[2]);
  }
  // Of what the held force follows before its first step only the value is known, later it follows nothing.
  double reaction_by_tip_displacement() const { return by_tip(-spring->reaction_slopes().force_by_depth); }
  double reaction_by_tip_velocity() const {
    return by_tip(is_set((reached ? *reached : tip_displacement)[1]) ? 0.0 : -spring->reaction_slopes().force_by_rate);
  }
  double contact_energy_by_tip_displacement() const { return by_tip(-spring->elastic_reaction()); }
  double dissipated_energy() const { return spring->dissipated_energy() + (held ? held->dissipated() : 0.0); }

  void save(std::vector<double>& state) const override {
    spring->save(state);
    if (!held) return;
    const auto more = spring::flat(held->state());
    state.insert(state.end(), more.begin(), more.end());
  }

  void restore(const std::vector<double>& state) override {
    using Held = spring::HeldContact::State;
    const std::size_t own = held ? spring::Flat<Held>{}.size() : 0;
    if (state.size() < own) throw std::invalid_argument("spring: a saved state is too short");
    const auto mine = state.end() - static_cast<std::ptrdiff_t>(own);
    std::optional<spring::HeldContact> restored = held;
    if (restored) restored->restore(spring::from_flat<Held>(&*mine));
    spring->restore({state.begin(), mine});
    held = restored;
    keep_tip();
  }

 private:
  static constexpr long most_trial_work = 100'000;  ///< of IDA's steps for one force
  static constexpr double rounding = 1e-6;          ///< of communication_step
  static constexpr int most_missed = 10;            ///< steps; a sudden load takes 2, a harmonic one from rest up to 8
  static constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  static constexpr const char* no_force =
      "spring: the contact force leaves the range of floating-point numbers; the tip is too far or too fast";

  bool warned_ = false;

  double by_tip(double partial) const { return !held ? partial : held->started() ? 0.0 : unknown; }

  static bool is_set(double derivative) { return !std::isnan(derivative); }

  /// The tip from now on: tip_velocity is its rate where tip_displacement has no derivative.
  fmi::Polynomial tip() const {
    fmi::Polynomial tip = reached ? *reached : tip_displacement;
    const double curvature = is_set(tip[1]) ? 0.0 : tip_velocity[1];
    if (!is_set(tip[1])) tip[1] = tip_velocity[0];
    if (!is_set(tip[2])) tip[2] = curvature;
    return tip;
  }

  void keep_tip() {
    if (held) return;
    const fmi::Polynomial tip = spring->tip();
    reached = {tip[0], tip[1] == tip_velocity[0] ? fmi::unset : tip[1], fmi::unset};
  }

  /// A pair that is wired wrongly gains energy without a sign: say so, once.
  void check_wiring() {
    if (warned_) return;
    if (held && held->missed() >= most_missed) {
      warning = "the tip was not where it was foreseen in " + std::to_string(held->missed()) + " steps, by up to " +
                common::number(held->farthest()) +
                " m, so the contact gains or loses energy. Connect tip_displacement and tip_velocity_forecast of the "
                "beam to the inputs of these names and reaction to its tip_force; set communication_step in both to "
                "the step size, tip_response and tip_response_2 to the beam's; pass values on between the steps only, "
                "for both FMUs alike (Jacobi). Loads on the beam that change much within a step show here, too";
    } else if (!held && forecast[0] != 0.0 && parameters.compliant()) {
      warning =
          "tip_velocity_forecast arrives but is not used, as communication_step = 0: a contact that the steps do not "
          "resolve gains energy. Set communication_step, tip_response and tip_response_2 to those of the beam, or "
          "communication_step of the beam to 0";
    }
    warned_ = !warning.empty();
  }

  spring::TipMessage message() const { return {tip_displacement[0], forecast[0]}; }

  /// What acts from now on, but for what the contact law does not read.
  spring::Inputs acting() const {
    spring::Inputs present = inputs;
    if (parameters.compliant()) present.contact_force = {held ? held->force() : 0.0, 0.0, 0.0};
    present.tip_displacement = tip();
    return present;
  }

  /// Where the top would be after the next step, other inputs staying as they are; the spring is left as it was.
  spring::HeldContact::Top trial() {
    std::vector<double> start;
    spring->save(start);
    spring::Inputs next = acting();
    for (auto* input : {&next.foundation_force, &next.external_force, &next.base_acceleration})
      (*input)[1] = (*input)[2] = 0.0;
    return [this, start, next, work = 0L](double force) mutable {
      if (work > most_trial_work) return unknown;
      next.contact_force[0] = force;
      const long before = spring->ida_steps();
      try {
        spring->step(held->size(), next);
      } catch (const spring::StepFailure&) {
        return unknown;  // the step itself will tell
      }
      work += spring->ida_steps() - before;
      const double reached = spring->displacement();
      spring->restore(start);
      return reached;
    };
  }

  /// To the acceleration. Without a finite force `reaction` has no value, and the next step is refused.
  void show_force() {
    if (std::isfinite(held->force())) spring->observe(acting());
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
      "Duffing spring m y'' + alpha_s y' + k1 y + k2 y^3 = -C + N + f_s under a contact force C, above a rigid "
      "foundation";
  t.stop_time = 0.6;
  t.step_size = 1e-3;
  t.tolerance = 1e-6;  // for the tool's own use: what it hands on never loosens relative_tolerance
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
  parameter(
      "equilibrium", "m", &FmuParameters::equilibrium,
      "position Psi where the top rests: it starts there, unless displacement has a start value other than 0. The "
      "spring's force is 0 at y = 0 all the same");
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
            "relative tolerance of IDA; an importer's tolerance can tighten, never loosen it")
      .range(std::numeric_limits<double>::min(), 1e-2)
      .typical(1e-12);
  parameter("absolute_tolerance", "", &Parameters::absolute_tolerance, "absolute tolerance of IDA")
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
    model.tip_displacement = value;  // with what is unset
    model.reached.reset();
  };
  add.input("tip_velocity", "m/s",
            "velocity of the beam's tip, read by contact_law = 2 where no derivative of tip_displacement is set; its "
            "derivative of order 1 is the tip's acceleration, that of order 2 is not used",
            &SpringModel::tip_velocity);
  add.input("tip_velocity_forecast", "m/s",
            "for communication_step > 0: tip_velocity_forecast of the beam; its derivatives are not used",
            &SpringModel::forecast);

  add.output("displacement", "m", "position y of the top", of(&Spring::displacement), of(&Spring::velocity));
  add.exact_start(&SpringModel::parameters, &FmuParameters::displacement);
  add.output("velocity", "m/s", "velocity z of the top", of(&Spring::velocity), of(&Spring::acceleration));
  add.exact_start(&SpringModel::parameters, &FmuParameters::velocity);
  add.output("displacement_integral", "m.s", "integral of displacement over the last step",
             of(&Spring::displacement_integral), of(&Spring::displacement));
  add.output("displacement_integral_2", "m.s2", "double integral of displacement over the last step",
             of(&Spring::displacement_integral_2), of(&Spring::displacement_integral));
  add.output(
         "reaction", "N", "contact force of the law inside, 0 when contact_law = 1",
         [](const SpringModel& m) { return m.reaction(); }, [](const SpringModel& m) { return m.reaction_rate(); })
      .from({"contact_law", "compliance_stiffness", "compliance_exponent", "compliance_damping", "displacement",
             "tip_displacement", "tip_velocity",
             // with communication_step > 0, of which the first is foreseen:
             "communication_step", "tip_response", "tip_velocity_forecast", "velocity", "mass", "damping",
             "linear_stiffness", "cubic_stiffness", "external_force", "base_acceleration", "foundation_force",
             "stop_enabled", "stop_position", "restitution", "equilibrium"});
  add.depends("tip_displacement", [](const SpringModel& m) { return m.reaction_by_tip_displacement(); });
  add.depends("tip_velocity", [](const SpringModel& m) { return m.reaction_by_tip_velocity(); });
  add.output("stop_force", "N", "mean foundation force of the law inside over the last step", of(&Spring::stop_force));
  add.output("stop_impulse", "N.s", "sum of the foundation's impulses over the last step", of(&Spring::stop_impulse));
  add.output("kinetic_energy", "J", "kinetic energy", of(&Spring::kinetic_energy)).from({"mass", "velocity"});
  add.output("potential_energy", "J", "potential energy of the spring", of(&Spring::potential_energy))
      .from({"linear_stiffness", "cubic_stiffness", "displacement", "equilibrium"});
  add.output("contact_energy", "J", "energy stored in the contact law inside",
             [](const SpringModel& m) { return m.contact_energy(); })
      .from({"contact_law", "compliance_stiffness", "compliance_exponent", "displacement", "equilibrium",
             "tip_displacement"});
  add.depends("tip_displacement", [](const SpringModel& m) { return m.contact_energy_by_tip_displacement(); });
  add.output("dissipated_energy", "J", "work of the damping force and of the contact's damping since the start",
             [](const SpringModel& m) { return m.dissipated_energy(); });
  add.output("load_work", "J",
             "work of external_force and base_acceleration since the start, where it is 0, impacts and rest on the "
             "foundation inside included",
             of(&Spring::load_work));
  add.output("impact_loss", "J", "energy lost in impacts on the foundation inside since the start",
             of(&Spring::impact_loss));
  add.output("internal_steps", "", "steps that IDA took since the start",
             [](const SpringModel& m) { return static_cast<double>(m.spring->ida_steps()); });
  return t;
}

std::unique_ptr<fmi::Model> fmi::make_model() { return std::make_unique<SpringModel>(); }
