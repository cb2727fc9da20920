// The spring FMU: its table of variables, bound to SpringModel.
#include <limits>
#include <string>
#include <vector>

#include "../adapter/table.hpp"
#include "spring_model.hpp"

namespace {

using spring::Parameters;
using spring::Spring;

}  // namespace

fmi::Table fmi::make_table() {
  fmi::Table t;
  t.identifier = "spring";
  t.title = "DuffingSpring";
  t.description =
      "Duffing spring m y'' + alpha_s y' + k1 x + k2 x^3 = -C + N + f_s, x = y - unloaded, under a contact force C, "
      "above a rigid foundation";
  t.stop_time = 0.6;
  t.ends_steps_early = true;
  t.choices.push_back(
      {"ContactLaw",
       "source of the contact force",
       {"external, the input contact_force", "normal_compliance, computed here from tip_displacement and tip_velocity",
        "kelvin_voigt, a unilateral spring and damper, computed here as well"}});

  fmi::TableBuilder<SpringModel> add(t);
  add.parameter("mass", "kg", &Parameters::mass, "mass m").positive();
  add.parameter("damping", "N.s/m", &Parameters::damping, "viscous damping alpha_s").at_least(0);
  add.parameter("linear_stiffness", "N/m", &Parameters::linear_stiffness, "linear stiffness k1");
  add.parameter("cubic_stiffness", "N/m3", &Parameters::cubic_stiffness,
                "cubic stiffness k2; negative for a softening spring");
  add.parameter("unloaded", "m", &Parameters::unloaded,
                "position of the top at which the spring force is 0: the force is k1 x + k2 x^3 with x = y - unloaded");
  add.parameter(
      "equilibrium", "m", &FmuParameters::equilibrium,
      "rest position Psi of the top, for information only: the motion begins at the start value of displacement, "
      "and the spring force is 0 at unloaded");
  add.parameter("gravity", "m/s2", &FmuParameters::gravity,
                "gravitational acceleration g, downward: adds the force -mass*g, whose work is part of load_work");
  add.parameter(
         "contact_law", "", &Parameters::contact_law,
         "1 = external (input contact_force), 2 = normal compliance, 3 = unilateral spring and damper, both computed "
         "by this FMU")
      .range(1, 3)
      .choice = "ContactLaw";
  add.parameter("compliance_stiffness", "", &Parameters::compliance_stiffness,
                "lambda in C = lambda*max(0, d)^p*max(0, 1 + chi*d') [N/m^p], d = y - u_tip, of contact_law = 2; in "
                "max(0, lambda*d^p + c*d') for d > 0 of contact_law = 3")
      .at_least(0)
      .typical(1e4);
  add.parameter("compliance_exponent", "", &Parameters::compliance_exponent, "exponent p in the contact law")
      .range(1, 100);
  add.parameter("compliance_damping", "s/m", &Parameters::compliance_damping,
                "damping chi of contact_law = 2 (Hunt and Crossley); the energy that it dissipates is part of "
                "dissipated_energy")
      .at_least(0);
  add.parameter("contact_damping", "N.s/m", &Parameters::contact_damping,
                "damping c of contact_law = 3, as compliance_damping")
      .at_least(0);
  add.parameter("stop_enabled", "", &Parameters::stop_enabled,
                "whether this FMU has the rigid foundation, with impacts");
  add.parameter("stop_position", "m", &Parameters::stop_position, "position phi of the foundation");
  add.parameter("restitution", "", &Parameters::restitution, "coefficient of restitution at the foundation")
      .range(0, 1);
  add.parameter("relative_tolerance", "", &Parameters::relative_tolerance,
                "relative tolerance of the motion; an importer's tolerance can tighten, never loosen it")
      .range(std::numeric_limits<double>::min(), 1e-2)
      .typical(1e-12);
  add.parameter("absolute_tolerance", "", &Parameters::absolute_tolerance, "absolute tolerance of the motion")
      .range(std::numeric_limits<double>::min(), 1e-2)
      .typical(1e-14);

  const auto input = [&](const char* name, const char* unit, fmi::Polynomial spring::Inputs::*field, const char* text) {
    add.input(name, unit, text, [field](SpringModel& m, const fmi::Polynomial& value) { m.inputs.*field = value; });
  };
  input("contact_force", "N", &spring::Inputs::contact_force,
        "contact force C, positive presses the spring down; its derivatives of order 1 and 2 hold for the next step "
        "only: C(tau) = C + C' tau + C'' tau^2/2; ignored when contact_law > 1");
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
            "displacement of the beam's tip, used when contact_law > 1; extrapolated over the step with its "
            "derivatives or, where the first is 0, with tip_velocity",
            [](SpringModel& m, const fmi::Polynomial& value) {
              m.tip_displacement = value;
              m.extrapolated = false;
            });
  add.input("tip_velocity", "m/s",
            "velocity of the beam's tip, used when contact_law > 1 and the derivative of tip_displacement is 0; its "
            "derivative of order 1 is the tip's acceleration, that of order 2 is not used",
            [](SpringModel& m, const fmi::Polynomial& value) {
              m.tip_velocity = value;
              m.tip_velocity_is_set = true;
            });
  add.input("tip_velocity_forecast", "m/s",
            "tip_velocity_forecast of the beam, used when tip_response > 0; its derivatives are not used",
            &SpringModel::forecast)
      .value_only();
  add.input("tip_response", "m/N",
            "tip_response of the beam. If > 0 and contact_law > 1, the tip is predicted, and reaction is constant over "
            "each step at the value that does the work of the contact law: no step size adds energy. If 0, the contact "
            "law acts with the extrapolated tip. Its derivatives are not used",
            &SpringModel::response)
      .typical(1e-4)
      .value_only();
  add.input("tip_response_2", "m/N", "tip_response_2 of the beam, as tip_response", &SpringModel::response_2)
      .typical(1e-4)
      .value_only();

  add.output("displacement", "m", "position y of the top", &Spring::displacement, &Spring::velocity);
  add.exact_start(&FmuParameters::displacement);
  add.output("velocity", "m/s", "velocity z of the top", &Spring::velocity, &Spring::acceleration);
  add.exact_start(&FmuParameters::velocity);
  const std::vector<std::string> motion{
      "contact_law", "compliance_stiffness", "compliance_exponent", "compliance_damping", "contact_damping",
      "displacement", "tip_displacement", "tip_velocity",
      // with tip_response > 0, of which the first is predicted:
      "tip_response", "tip_velocity_forecast", "velocity", "mass", "damping", "linear_stiffness", "cubic_stiffness",
      "unloaded", "external_force", "base_acceleration", "foundation_force", "stop_enabled", "stop_position",
      "restitution", "gravity"};
  // What force and contact force follow at once, with a derivative of one.
  const std::vector<std::string> at_once{"tip_displacement", "tip_velocity",   "tip_velocity_forecast", "tip_response",
                                         "foundation_force", "external_force", "base_acceleration"};
  std::vector<std::string> pressing = at_once, accelerated = motion;
  pressing.insert(pressing.begin(), "contact_force");
  accelerated.emplace_back("contact_force");
  add.output("displacement_integral", "m.s", "integral of displacement over the last step",
             &Spring::displacement_integral, &Spring::displacement);
  add.output("displacement_integral_2", "m.s2", "double integral of displacement over the last step",
             &Spring::displacement_integral_2, &Spring::displacement_integral);
  add.output("reaction", "N", "contact force computed by this FMU; 0 when contact_law = 1", &SpringModel::reaction,
             &SpringModel::reaction_rate)
      .from(motion)
      .follows(at_once)
      .follows({"tip_displacement"}, 1);
  add.output("acceleration", "m/s2", "acceleration of the top", &Spring::acceleration, &SpringModel::jerk)
      .from(accelerated)
      .follows(pressing)
      .follows({"tip_displacement"}, 1);
  add.output("seated", "",
             "1 while the top rests on the foundation inside, otherwise 0: the sign of the force that holds it there, "
             "under the present inputs, decides",
             &Spring::seated)
      .steps_only()
      .from(accelerated)
      .follows(pressing)
      .follows({"tip_displacement"}, 1);
  add.output("number_of_impacts", "", "number of impacts on the foundation since the start", &Spring::impacts)
      .steps_only();
  add.output("last_impact_time", "s", "time of the last impact; -1 if there was none", &Spring::last_impact);
  add.output("stop_force", "N", "mean force of the foundation on the top over the last step, without impacts",
             &Spring::stop_force);
  add.output("stop_impulse", "N.s", "sum of the impulses of the foundation on the top over the last step",
             &Spring::stop_impulse);
  add.output("kinetic_energy", "J", "kinetic energy", &Spring::kinetic_energy, &SpringModel::kinetic_power)
      .from({"mass", "velocity"});
  add.output("potential_energy", "J", "potential energy of the spring", &Spring::potential_energy,
             &SpringModel::potential_power)
      .from({"linear_stiffness", "cubic_stiffness", "unloaded", "displacement"});
  add.output("contact_energy", "J", "energy stored in the contact", &SpringModel::contact_energy,
             &SpringModel::contact_power)
      .from({"contact_law", "compliance_stiffness", "compliance_exponent", "displacement", "tip_displacement"})
      .follows({"tip_displacement"});
  add.output("dissipated_energy", "J",
             "energy dissipated since the start by the damping of the spring and of the contact",
             &SpringModel::dissipated_energy, &SpringModel::dissipated_power);
  add.output("load_work", "J",
             "work of external_force, gravity and base_acceleration since the start, also across impacts and while the "
             "top rests on the foundation",
             &Spring::load_work, &SpringModel::load_power);
  add.local("impact_loss", "J", "energy lost in impacts on the foundation since the start", &Spring::impact_loss);
  add.output("warnings", "",
             "number of steps with a warning: the FMUs are connected wrongly, or a step was discarded. Many tools hide "
             "the messages that say which; restoring a state does not lower the number",
             &SpringModel::warnings)
      .steps_only();
  add.local("internal_steps", "",
            "internal steps since the start: parts with a Taylor series of their own, and steps of IDA",
            &Spring::internal_steps);
  return t;
}

std::unique_ptr<fmi::Model> fmi::make_model() { return std::make_unique<SpringModel>(); }
