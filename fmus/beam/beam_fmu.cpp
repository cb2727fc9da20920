// The beam FMU: its table of variables, bound to BeamModel.
#include "beam_model.hpp"

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "../adapter/table.hpp"

namespace {

using beam::Beam;
using beam::Loads;
using beam::Parameters;

using Builder = fmi::TableBuilder<BeamModel>;
using M = const BeamModel&;

std::string position(std::size_t i) { return "point_force_position[" + std::to_string(i + 1) + "]"; }

/// All loads that are inputs; that of the hat function is a parameter.
std::vector<std::string> loads() { return {Loads::names.begin(), Loads::names.begin() + Loads::hat}; }

void add_parameters(Builder& add) {
  add.parameter("density", "kg/m3", &Parameters::density, "mass density rho").positive();
  add.parameter("area", "m2", &Parameters::area, "area of the cross-section A").positive();
  add.parameter("second_moment_of_area", "m4", &Parameters::second_moment_of_area, "second moment of area I")
      .positive();
  add.parameter("young_modulus", "Pa", &Parameters::young_modulus, "Young's modulus E").positive();
  add.parameter("shear_modulus", "Pa", &Parameters::shear_modulus, "shear modulus G").positive();
  add.parameter("shear_coefficient", "", &Parameters::shear_coefficient, "shear coefficient K").positive();
  add.parameter("length", "m", &Parameters::length, "length L").positive();
  add.parameter("alpha_b", "s", &Parameters::alpha_b, "Kelvin-Voigt retardation time: damping = alpha_b * stiffness")
      .at_least(0);
  add.parameter("n_elements", "", &Parameters::n_elements, "uniform elements").range(1, beam::max_elements);
  add.parameter("element_degree", "", &Parameters::element_degree,
                "polynomial degree of deflection and rotation in an element; 1 = linear elements")
      .range(1, beam::max_element_degree);
  add.parameter("n_modes", "", &Parameters::n_modes, "lowest modes kept by the modal integrator; 0 = all of the mesh's")
      .range(0, beam::max_dense_unknowns);
  add.parameter(
      "reduced_integration", "", &Parameters::reduced_integration,
      "as many Gauss points for the shear term as element_degree; false = exact integration, which locks for slender "
      "beams of degree 1");
  add.parameter("mass_matrix", "", &Parameters::mass_matrix, "1 = consistent, 2 = averaged").range(1, 2).choice =
      "MassMatrix";
  fmi::Variable& integrator = add.parameter("integrator", "", &Parameters::integrator, "1 = modal, 2 = midpoint");
  integrator.range(1, 2).choice = "Integrator";
  add.parameter("initial_deflection_slope", "", &Parameters::initial_deflection_slope,
                "s in the initial deflection u = s*x");
  add.parameter("initial_velocity_slope", "1/s", &Parameters::initial_velocity_slope,
                "s in the initial velocity u_t = s*x");
  add.parameter("tip_load_coefficient", "N/m", &FmuParameters::tip_load_coefficient,
                "coefficient of the last hat function in the distributed load");
  for (std::size_t i = 0; i < Loads::tip - Loads::point; ++i) {
    add.parameter(
           position(i), "", [i](FmuParameters& p) -> double& { return p.point_force_position[i]; },
           "where point_force[" + std::to_string(i + 1) + "] acts, x/L")
        .range(0, 1);
  }
  add.parameter(
      "gravity", "m/s2", &FmuParameters::gravity,
      "gravitational acceleration g, downward: adds -density*area*g to distributed_load, also in load_work and "
      "load_potential");
  add.parameter(
         "initial_state", "", &FmuParameters::initial_state,
         "1 = given by initial_deflection_slope and initial_velocity_slope, 2 = at rest, in equilibrium with the "
         "loads and the tip force at the start")
      .range(1, 2)
      .choice = "InitialState";
  add.parameter("section_height", "m", &FmuParameters::section_height,
                "height of the cross-section h, for max_bending_stress; 0 = not given")
      .at_least(0);
}

void add_inputs(Builder& add) {
  add.input(
      "tip_force", "N",
      "contact force C on the tip, positive upward; its derivatives of order 1 and 2 hold for the next step only: "
      "C(tau) = C + C' tau + C'' tau^2/2. The midpoint rule uses their mean over the step",
      &BeamModel::tip_force);
  add.impulse("tip_impulse", "N.s", "upward impulse on the tip, applied at the start of the next step, then 0 again",
              &BeamModel::tip_impulse);
  const auto load = [&](std::size_t i, const char* unit, const std::string& text) {
    add.input(Loads::names[i], unit, text, [i](BeamModel& m, const fmi::Polynomial& value) {
      i == Loads::distributed ? m.set_distributed(value) : m.loads.set(i, value);
    });
  };
  load(Loads::distributed, "N/m",
       "uniform part of the distributed load f_b, positive upward; derivatives as for tip_force");
  for (std::size_t i = 1; i < Loads::point; ++i) {
    load(i, "N/m",
         "part of the distributed load f_b that grows as (x/L)^" + std::to_string(i) +
             ": f_b is the sum of all four; derivatives as for tip_force");
  }
  for (std::size_t i = Loads::point; i < Loads::tip; ++i) {
    load(i, "N", "force at x = L*" + position(i - Loads::point) + ", positive upward; derivatives as for tip_force");
  }
  load(Loads::tip, "N",
       "load on the tip, positive upward: its work is part of load_work, that of tip_force is not; derivatives as for "
       "tip_force");
  load(Loads::base_acceleration, "m/s2",
       "acceleration a of the clamp, upward; all displacements are relative to it, so that it acts as a distributed "
       "load of -density*area*a; derivatives as for tip_force");
}

/// What steps make.
void add_results(Builder& add) {
  add.output("tip_displacement", "m", "deflection of the tip u(L)", &Beam::tip_displacement, &Beam::tip_velocity)
      .from_all();
  add.output("tip_velocity", "m/s", "velocity of the tip", &Beam::tip_velocity, &Beam::tip_acceleration)
      .from({"initial_velocity_slope", "length", "initial_state"});
  add.output("tip_rotation", "rad", "rotation of the cross-section at the tip", &Beam::tip_rotation,
             &Beam::tip_rotation_rate)
      .from_all();
  add.output("tip_displacement_integral", "m.s", "integral of tip_displacement over the last step",
             &Beam::tip_displacement_integral, &Beam::tip_displacement);
  add.output("tip_displacement_integral_2", "m.s2", "double integral of tip_displacement over the last step",
             &Beam::tip_displacement_integral_2, &Beam::tip_displacement_integral);
  add.output("kinetic_energy", "J", "kinetic energy", &Beam::kinetic_energy, &Beam::kinetic_power)
      .from({"density", "area", "length", "initial_velocity_slope", "mass_matrix", "element_degree", "n_elements",
             "initial_state"});
  add.output("strain_energy", "J", "strain energy", &Beam::strain_energy, &Beam::strain_power).from_all();
  add.output("dissipated_energy", "J", "energy dissipated by the damping since the start", &Beam::dissipated_energy,
             &Beam::dissipated_power);
  add.output("load_potential", "J",
             "potential of the loads distributed_load, gravity and tip_load_coefficient, as if they were constant",
             &Beam::load_potential, &BeamModel::load_potential_rate)
      .from_all()
      .follows({"distributed_load"});
  add.output("load_work", "J",
             "work of all loads on the beam since the start: distributed_load, point_force, tip_load, "
             "base_acceleration and tip_load_coefficient, not tip_force or tip_impulse. A load that is present at the "
             "start is applied suddenly, unless initial_state = 2. kinetic_energy + strain_energy + "
             "dissipated_energy - load_work changes by the work of tip_force and tip_impulse alone",
             &Beam::load_work, &Beam::load_power);
  add.output("warnings", "", "number of discarded steps; restoring a state does not lower it", &BeamModel::refused)
      .steps_only();
  std::vector<std::string> discretised{"density",        "area",    "second_moment_of_area", "young_modulus",
                                       "shear_modulus",  "length",  "shear_coefficient",     "n_elements",
                                       "element_degree", "n_modes", "reduced_integration",   "integrator",
                                       "mass_matrix"};
  add.output("tip_mass", "kg",
             "effective mass of the tip, 1/(e'M^-1 e) of the discrete beam: an impulse J on the tip changes "
             "tip_velocity by J/tip_mass",
             &Beam::tip_mass)
      .from(discretised);
  discretised.emplace_back("alpha_b");
  add.output(
         "tip_velocity_forecast", "m/s",
         "predicted mean velocity of the tip over the next two steps without a tip_force; steps have the size of the "
         "last one, before the first that of DefaultExperiment",
         &BeamModel::forecast, &BeamModel::forecast_rate)
      .only_read()
      .from_all()
      .follows(loads());
  add.output(
         "tip_response", "m/N",
         "change of tip_displacement at the end of a step, per newton of constant tip force in that step; for steps "
         "as for tip_velocity_forecast",
         [](M m) { return m.tip_response()[0]; })
      .only_read()
      .from(discretised)
      .typical(1e-4);
  add.output("tip_response_2", "m/N",
             "as tip_response, but at the end of the following step, in which no tip force acts",
             [](M m) { return m.tip_response()[1]; })
      .only_read()
      .from(discretised)
      .typical(1e-4);
}

/// What follows forces without delay: linear functions of the response, of which the derivative is that of its rate.
void add_instant_results(Builder& add) {
  const auto instant = [&](const char* name, const char* unit, const char* text, auto of_response) {
    add.output(
           name, unit, text, [=](M m) { return of_response(m, m.response()); },
           [=](M m) { return of_response(m, m.response_rate()); })
        .from_all()
        .follows({"tip_force"})
        .follows(loads());
  };
  using R = const Beam::Response&;
  instant("tip_acceleration", "m/s2", "acceleration of the tip", [](M, R r) { return r.tip_acceleration; });
  instant("clamp_force", "N", "force of the clamp on the beam, upward; with all loads it balances the momentum",
          [](M, R r) { return -r.forces.shear[0]; });
  instant("clamp_moment", "N.m", "moment of the clamp on the beam, counter-clockwise",
          [](M, R r) { return -r.forces.moment[0]; });
  instant("max_bending_stress", "Pa",
          "largest bending stress |M| h/2I at the points x = 0, L/20, ..., L; 0 if section_height is",
          [](M m, R r) { return m.bending_stress(r.forces); });
}

/// Along the beam.
void add_shapes(Builder& add) {
  const auto shape = [&](const std::string& name, const char* unit, const std::string& text, auto values) {
    for (std::size_t i = 0; i < beam::shape_points; ++i) {
      add.local(name + "[" + std::to_string(i + 1) + "]", unit, text + " at x = L*" + std::to_string(i) + "/20",
                [=](M m) { return values(m)[i]; })
          .elements = i == 0 ? beam::shape_points : 0;
    }
  };
  using S = const beam::Shape&;
  shape("deflection", "m", "deflection", [](M m) -> S { return m.line().deflection; });
  shape("rotation", "rad", "rotation of the cross-section", [](M m) -> S { return m.line().rotation; });
  shape("bending_moment", "N.m", "bending moment, positive where it bends the beam upwards",
        [](M m) -> S { return m.response().forces.moment; });
  shape("shear_force", "N", "shear force of the part beyond the point on the part before it, positive upward",
        [](M m) -> S { return m.response().forces.shear; });
}

}  // namespace

fmi::Table fmi::make_table() {
  fmi::Table t;
  t.identifier = "beam";
  t.title = "TimoshenkoBeam";
  t.description =
      "Viscoelastic (Kelvin-Voigt) Timoshenko beam, clamped at x = 0, loaded at its tip x = L by a contact force";
  t.stop_time = 0.6;
  t.choices.push_back({"MassMatrix",
                       "mass of an element",
                       {"consistent, its kinetic energy exact",
                        "averaged with the lumped one, so that short waves travel at the right speed"}});
  t.choices.push_back({"InitialState",
                       "state of the beam at the start",
                       {"given by initial_deflection_slope and initial_velocity_slope", "at rest under the loads"}});
  t.choices.push_back({"Integrator",
                       "time integration of the beam",
                       {"modal, the exact step of each mode under polynomial loads",
                        "midpoint rule, which uses the mean of each force over the step"}});

  Builder add(t);
  add_parameters(add);
  add_inputs(add);
  add_results(add);
  add_instant_results(add);
  add_shapes(add);
  return t;
}

std::unique_ptr<fmi::Model> fmi::make_model() { return std::make_unique<BeamModel>(); }
