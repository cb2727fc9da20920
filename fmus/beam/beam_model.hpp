// The beam behind the FMU's variables: Beam, what the FMU adds to its parameters, and what is computed for readers
// only.
#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include "../../src_beam/beam.hpp"
#include "../adapter/flat.hpp"
#include "../adapter/learnt_step.hpp"
#include "../adapter/model.hpp"

enum class InitialState { given = 1, at_rest = 2 };

/// The beam's parameters and what the FMU adds to them.
struct FmuParameters : beam::Parameters {
  double tip_load_coefficient = 0.0;
  double gravity = 0.0;         ///< [m/s²]
  double section_height = 0.0;  ///< [m], 0: not given
  InitialState initial_state = InitialState::given;
  FmuParameters() { initial_velocity_slope = -1.0; }  // so that a first try shows a motion
};

class BeamModel final : public fmi::Model {
 public:
  using Beam = beam::Beam;
  using Loads = beam::Loads;

  FmuParameters parameters;
  fmi::Polynomial tip_force{};
  Loads loads;
  double tip_impulse = 0.0;

  // The modes are exact and the midpoint rule has no error control: a tolerance has nothing to act on.
  void build(double) override {
    beam_ = beam::make_beam(parameters);
    loads.set(Loads::hat, {parameters.tip_load_coefficient, 0.0, 0.0});
    set_distributed({});
    size_ = fmi::default_step;
    answers_.reset();
  }

  void evaluate(Acting acting) override {
    derived_ = {};
    if (acting != Acting::as_stepped) beam_->set_forces(tip_force[0], loads);
    if (acting == Acting::at_start && parameters.initial_state == InitialState::at_rest) beam_->put_at_rest();
  }

  fmi::Reached step(double time, double size, bool) override {
    std::optional<Beam::State> before;
    if (tip_impulse != 0.0) before = beam_->state();
    try {
      if (tip_impulse != 0.0) beam_->apply_tip_impulse(tip_impulse);
      beam_->step(size, tip_force, loads);
    } catch (const std::exception& e) {
      using Remedy = fmi::Discarded::Remedy;
      if (before) beam_->restore(*before);
      const bool too_long = dynamic_cast<const std::domain_error*>(&e) != nullptr;
      throw fmi::Discarded(e.what(), too_long ? Remedy::other_size : Remedy::none);
    }
    size_ = fmi::learnt_step(size_, time, size);
    return {size, false};
  }

  void update(double) override {
    if (tip_impulse != 0.0) beam_->apply_tip_impulse(tip_impulse);
  }

  void save(std::vector<double>& state) const override {
    const Beam::State& now = beam_->state();
    fmi::flatten(state, now.q, now.v, now.scalars, size_);
  }
  void restore(const std::vector<double>& state) override {
    Beam::State then = beam_->state();
    fmi::restore(state, then.q, then.v, then.scalars, size_);
    beam_->restore(then);
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
    if (!derived_.line) derived_.line = Line{beam_->deflection(), beam_->rotation()};
    return *derived_.line;
  }
  /// Quantities that depend on forces without delay. A tool that reads them after each step does not pay for the shape.
  const Beam::Response& response() const {
    if (!derived_.response) derived_.response = beam_->response();
    return *derived_.response;
  }
  Beam::Response response_rate() const { return beam_->response_rate(load_rates(), tip_force[1]); }
  double load_potential_rate() const { return beam_->load_potential_rate(load_rates()); }
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
    if (!derived_.forecast) derived_.forecast = foreseen([this] { return beam_->forecast(size_); });
    return *derived_.forecast;
  }
  double forecast_rate() const {
    return foreseen([this] { return beam_->forecast_rate(size_, load_rates()); });
  }
  const Beam::TipResponse& tip_response() const {
    if (!answers_ || answers_->size != size_)
      answers_ = Answers{size_, foreseen([this] { return beam_->tip_response(size_); })};
    return answers_->response;
  }

  const Beam& body() const { return *beam_; }

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
  std::unique_ptr<Beam> beam_;
  double size_ = fmi::default_step;  ///< H, of the last step [s]
};
