// The beam FMU: its table of variables, bound to beam::Beam.
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "../../src_beam/beam.hpp"
#include "../adapter/flat.hpp"
#include "../adapter/learnt_step.hpp"
#include "../adapter/table.hpp"

namespace {

using beam::Beam;
using beam::Loads;
using beam::Parameters;

/// The beam's parameters and what exchange between steps adds to them.
enum class InitialState { given = 1, at_rest = 2 };

struct FmuParameters : Parameters {
  double tip_load_coefficient = 0.0;
  double gravity = 0.0;         ///< [m/s²]
  double section_height = 0.0;  ///< [m], 0: not given
  InitialState initial_state = InitialState::given;
  FmuParameters() { initial_velocity_slope = -1.0; }  // so that a first try shows a motion
};

struct BeamModel final : fmi::Model {
  FmuParameters parameters;
  fmi::Polynomial tip_force{};
  Loads loads;
  double tip_impulse = 0.0;
  std::unique_ptr<Beam> beam;
  bool starts_at_rest = false;  ///< at the start, where that is a state of rest

  // The modes are exact and the midpoint rule has no error control: a tolerance has nothing to act on.
  void build(double) override {
    beam = beam::make_beam(parameters);
    loads.set(Loads::hat, {parameters.tip_load_coefficient, 0.0, 0.0});
    set_distributed({});
    size_ = fmi::default_step;
    answers_.reset();
  }

  void evaluate(Acting acting) override {
    derived_ = {};
    starts_at_rest = acting == Acting::at_start && parameters.initial_state == InitialState::at_rest;
    if (acting != Acting::as_stepped) beam->set_forces(tip_force[0], loads);
    if (starts_at_rest) beam->put_at_rest();
  }

  fmi::Reached step(double time, double size, bool) override {
    std::optional<Beam::State> before;
    if (tip_impulse != 0.0) before = beam->state();
    try {
      if (tip_impulse != 0.0) beam->apply_tip_impulse(tip_impulse);
      beam->step(size, tip_force, loads);
    } catch (const std::exception& e) {
      using Remedy = fmi::Discarded::Remedy;
      if (before) beam->restore(*before);
      const bool too_long = dynamic_cast<const std::domain_error*>(&e) != nullptr;
      throw fmi::Discarded(e.what(), too_long ? Remedy::other_size : Remedy::none);
    }
    size_ = fmi::learnt_step(size_, time, size);
    return {size, false};
  }

  void update(double) override {
    if (tip_impulse != 0.0) beam->apply_tip_impulse(tip_impulse);
  }

  void save(std::vector<double>& state) const override {
    const Beam::State& now = beam->state();
    fmi::flatten(state, now.q, now.v, now.scalars, size_);
  }
  void restore(const std::vector<double>& state) override {
    Beam::State then = beam->state();
    fmi::restore(state, then.q, then.v, then.scalars, size_);
    beam->restore(then);
  }

  void set_distributed(fmi::Polynomial value) {
    value[0] -= parameters.density * parameters.area * parameters.gravity;
    loads.set(Loads::distributed, value);
  }

  /// The shape at the present instant, found as a whole.
  struct Line {
    beam::Shape deflection, rotation;
  };
  const Line& line() const {
    if (!derived_.line) derived_.line = Line{beam->deflection(), beam->rotation()};
    return *derived_.line;
  }
  /// Quantities that depend on forces without delay. A tool that reads them after each step does not pay for the shape.
  const Beam::Response& response() const {
    if (!derived_.response) derived_.response = beam->response();
    return *derived_.response;
  }
  Beam::Response response_rate() const { return beam->response_rate(load_rates(), tip_force[1]); }
  double load_potential_rate() const { return beam->load_potential_rate(load_rates()); }
  /// Of `forces`, at the point where the bending moment is largest now.
  double bending_stress(const beam::InternalForces& forces) const {
    const beam::Shape& moment = response().forces.moment;
    Eigen::Index most = 0;
    moment.cwiseAbs().maxCoeff(&most);
    const double sign = moment[most] < 0.0 ? -1.0 : 1.0;
    return sign * forces.moment[most] * parameters.section_height / (2.0 * parameters.second_moment_of_area);
  }

  /// For a partner that exchanges values only between steps: how the tip goes on, and answers forces, in steps of the
  /// size of the last one.
  double forecast() const {
    if (!derived_.forecast) derived_.forecast = foreseen([this] { return beam->forecast(size_); });
    return *derived_.forecast;
  }
  double forecast_rate() const {
    return foreseen([this] { return beam->forecast_rate(size_, load_rates()); });
  }
  const Beam::TipResponse& tip_response() const {
    if (!answers_ || answers_->size != size_)
      answers_ = Answers{size_, foreseen([this] { return beam->tip_response(size_); })};
    return answers_->response;
  }

 private:
  /// Zeros, by which the partner knows that nothing is, where the midpoint rule cannot make such steps.
  template <class Foresee>
  static std::invoke_result_t<Foresee> foreseen(const Foresee& foresee) {
    try {
      return foresee();
    } catch (const std::domain_error&) {
      return {};
    }
  }
  Loads::Values load_rates() const {
    Loads::Values rates{};
    loads.for_each([&](std::size_t i, const fmi::Polynomial& f) { rates[i] = f[1]; });
    return rates;
  }

  /// Computed at first use, and kept until something changes.
  struct Derived {
    std::optional<Line> line;
    std::optional<Beam::Response> response;
    std::optional<double> forecast;
  };
  mutable Derived derived_;
  /// Kept as long as steps have the size that it is for.
  struct Answers {
    double size;
    Beam::TipResponse response;
  };
  mutable std::optional<Answers> answers_;
  double size_ = fmi::default_step;  ///< H, of the last step [s]
};

template <class Value>
auto of(Value (Beam::*value)() const) {
  return [value](const BeamModel& m) { return ((*m.beam).*value)(); };
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

  fmi::TableBuilder<BeamModel> add(t);
  const auto parameter = [&](const char* name, const char* unit, auto field, const char* text) -> fmi::Variable& {
    return add.parameter(name, unit, &BeamModel::parameters, field, text);
  };
  parameter("density", "kg/m3", &Parameters::density, "mass density rho").positive();
  parameter("area", "m2", &Parameters::area, "area of the cross-section A").positive();
  parameter("second_moment_of_area", "m4", &Parameters::second_moment_of_area, "second moment of area I").positive();
  parameter("young_modulus", "Pa", &Parameters::young_modulus, "Young's modulus E").positive();
  parameter("shear_modulus", "Pa", &Parameters::shear_modulus, "shear modulus G").positive();
  parameter("shear_coefficient", "", &Parameters::shear_coefficient, "shear coefficient K").positive();
  parameter("length", "m", &Parameters::length, "length L").positive();
  parameter("alpha_b", "s", &Parameters::alpha_b, "Kelvin-Voigt retardation time: damping = alpha_b * stiffness")
      .at_least(0);
  parameter("n_elements", "", &Parameters::n_elements, "uniform elements").range(1, beam::max_elements);
  parameter("element_degree", "", &Parameters::element_degree,
            "polynomial degree of deflection and rotation in an element; 1 = linear elements")
      .range(1, beam::max_element_degree);
  parameter("n_modes", "", &Parameters::n_modes, "lowest modes kept by the modal integrator; 0 = all of the mesh's")
      .range(0, beam::max_dense_unknowns);
  parameter(
      "reduced_integration", "", &Parameters::reduced_integration,
      "as many Gauss points for the shear term as element_degree; false = exact integration, which locks for slender "
      "beams of degree 1");
  parameter("mass_matrix", "", &Parameters::mass_matrix, "1 = consistent, 2 = averaged").range(1, 2).choice =
      "MassMatrix";
  fmi::Variable& integrator = parameter("integrator", "", &Parameters::integrator, "1 = modal, 2 = midpoint");
  integrator.range(1, 2).choice = "Integrator";
  parameter("initial_deflection_slope", "", &Parameters::initial_deflection_slope,
            "s in the initial deflection u = s*x");
  parameter("initial_velocity_slope", "1/s", &Parameters::initial_velocity_slope,
            "s in the initial velocity u_t = s*x");
  parameter("tip_load_coefficient", "N/m", &FmuParameters::tip_load_coefficient,
            "coefficient of the last hat function in the distributed load");
  const auto position = [](std::size_t i) { return "point_force_position[" + std::to_string(i + 1) + "]"; };
  for (std::size_t i = 0; i < Loads::tip - Loads::point; ++i) {
    add.parameter(
           position(i), "", &BeamModel::parameters,
           [i](FmuParameters& p) -> double& { return p.point_force_position[i]; },
           "where point_force[" + std::to_string(i + 1) + "] acts, x/L")
        .range(0, 1);
  }
  parameter("gravity", "m/s2", &FmuParameters::gravity,
            "gravitational acceleration g, downward: adds -density*area*g to distributed_load, also in load_work and "
            "load_potential");
  parameter("initial_state", "", &FmuParameters::initial_state,
            "1 = given by initial_deflection_slope and initial_velocity_slope, 2 = at rest, in equilibrium with the "
            "loads and the tip force at the start")
      .range(1, 2)
      .choice = "InitialState";
  parameter("section_height", "m", &FmuParameters::section_height,
            "height of the cross-section h, for max_bending_stress; 0 = not given")
      .at_least(0);

  add.input(
      "tip_force", "N",
      "contact force C on the tip, positive upward; its derivatives of order 1 and 2 hold for the next step only: "
      "C(tau) = C + C' tau + C'' tau^2/2. The midpoint rule uses their mean over the step",
      &BeamModel::tip_force);
  add.impulse("tip_impulse", "N.s", "upward impulse on the tip, applied at the start of the next step, then 0 again",
              &BeamModel::tip_impulse);
  std::vector<std::string> load_names;
  const auto load = [&](std::size_t i, const char* unit, const std::string& text) {
    load_names.emplace_back(Loads::names[i]);
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

  add.output("tip_displacement", "m", "deflection of the tip u(L)", of(&Beam::tip_displacement),
             of(&Beam::tip_velocity))
      .from_all();
  add.output("tip_velocity", "m/s", "velocity of the tip", of(&Beam::tip_velocity), of(&Beam::tip_acceleration))
      .from({"initial_velocity_slope", "length", "initial_state"});
  add.output("tip_rotation", "rad", "rotation of the cross-section at the tip", of(&Beam::tip_rotation),
             of(&Beam::tip_rotation_rate))
      .from_all();
  add.output("tip_displacement_integral", "m.s", "integral of tip_displacement over the last step",
             of(&Beam::tip_displacement_integral), of(&Beam::tip_displacement));
  add.output("tip_displacement_integral_2", "m.s2", "double integral of tip_displacement over the last step",
             of(&Beam::tip_displacement_integral_2), of(&Beam::tip_displacement_integral));
  add.output("kinetic_energy", "J", "kinetic energy", of(&Beam::kinetic_energy), of(&Beam::kinetic_power))
      .from({"density", "area", "length", "initial_velocity_slope", "mass_matrix", "element_degree", "n_elements",
             "initial_state"});
  add.output("strain_energy", "J", "strain energy", of(&Beam::strain_energy), of(&Beam::strain_power)).from_all();
  add.output("dissipated_energy", "J", "energy dissipated by the damping since the start", of(&Beam::dissipated_energy),
             of(&Beam::dissipated_power));
  add.output("load_potential", "J",
             "potential of the loads distributed_load, gravity and tip_load_coefficient, as if they were constant",
             of(&Beam::load_potential), [](const BeamModel& m) { return m.load_potential_rate(); })
      .from_all();
  add.depends("distributed_load");
  add.output("load_work", "J",
             "work of all loads on the beam since the start: distributed_load, point_force, tip_load, "
             "base_acceleration and tip_load_coefficient, not tip_force or tip_impulse. A load that is present at the "
             "start is applied suddenly, unless initial_state = 2. kinetic_energy + strain_energy + "
             "dissipated_energy - load_work changes by the work of tip_force and tip_impulse alone",
             of(&Beam::load_work), of(&Beam::load_power));
  add.output("warnings", "", "number of discarded steps; restoring a state does not lower it",
             [](const BeamModel& m) { return m.refused; })
      .steps_only();
  std::vector<std::string> discretised{"density",        "area",    "second_moment_of_area", "young_modulus",
                                       "shear_modulus",  "length",  "shear_coefficient",     "n_elements",
                                       "element_degree", "n_modes", "reduced_integration",   "integrator",
                                       "mass_matrix"};
  add.output("tip_mass", "kg",
             "effective mass of the tip, 1/(e'M^-1 e) of the discrete beam: an impulse J on the tip changes "
             "tip_velocity by J/tip_mass",
             of(&Beam::tip_mass))
      .from(discretised);
  discretised.emplace_back("alpha_b");
  add.output(
         "tip_velocity_forecast", "m/s",
         "predicted mean velocity of the tip over the next two steps without a tip_force; steps have the size of the "
         "last "
         "one, before the first that of DefaultExperiment",
         [](const BeamModel& m) { return m.forecast(); }, [](const BeamModel& m) { return m.forecast_rate(); })
      .only_read()
      .from_all();
  for (const std::string& name : load_names) add.depends(name);
  add.output(
         "tip_response", "m/N",
         "change of tip_displacement at the end of a step, per newton of constant tip force in that step; for steps "
         "as for tip_velocity_forecast",
         [](const BeamModel& m) { return m.tip_response()[0]; })
      .only_read()
      .from(discretised)
      .typical(1e-4);
  add.output("tip_response_2", "m/N",
             "as tip_response, but at the end of the following step, in which no tip force acts",
             [](const BeamModel& m) { return m.tip_response()[1]; })
      .only_read()
      .from(discretised)
      .typical(1e-4);
  // What follows forces without delay, as linear functions of the response.
  const auto instant = [&](const char* name, const char* unit, const char* text, auto of_response) {
    add.output(
           name, unit, text, [=](const BeamModel& m) { return of_response(m, m.response()); },
           [=](const BeamModel& m) { return of_response(m, m.response_rate()); })
        .from_all();
    add.depends("tip_force");
    for (const std::string& name : load_names) add.depends(name);
  };
  using M = const BeamModel&;
  using R = const Beam::Response&;
  instant("tip_acceleration", "m/s2", "acceleration of the tip", [](M, R r) { return r.tip_acceleration; });
  instant("clamp_force", "N", "force of the clamp on the beam, upward; with all loads it balances the momentum",
          [](M, R r) { return -r.forces.shear[0]; });
  instant("clamp_moment", "N.m", "moment of the clamp on the beam, counter-clockwise",
          [](M, R r) { return -r.forces.moment[0]; });
  instant("max_bending_stress", "Pa",
          "largest bending stress |M| h/2I at the points x = 0, L/20, ..., L; 0 if section_height is",
          [](M m, R r) { return m.bending_stress(r.forces); });
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
  return t;
}

std::unique_ptr<fmi::Model> fmi::make_model() { return std::make_unique<BeamModel>(); }
