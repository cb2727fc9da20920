// The Duffing spring with its foundation. Its motion is a Taylor series between events (flight.hpp); SUNDIALS IDA takes
// over where there is none.
//     m ÿ + α_s ẏ + k1 (y − y₀) + k2 (y − y₀)³ = −C + N + f_s − m a   (Ahn & Tate, eq. (6)),      up is positive.
// y₀ is where the spring force is 0, at 0 in (6); y is relative to the foundation, whose acceleration is a. C comes
// from outside (contact_law external) or from the normal compliance inside, C = λ_nc δ₊^p (1 + χ δ̇)₊, δ = y − u_tip; N
// comes from outside or, with the stop enabled, from Signorini's condition (8) with restitution:
//     0 ≤ N ⊥ y − φ ≥ 0,   z⁺ = −e z⁻ at an impact. Impacts that die out end seated, y = φ, until N would be < 0.
#pragma once

#include <stdexcept>
#include <string>

#include "equation_of_motion.hpp"
#include "flight.hpp"
#include "parameters.hpp"

namespace spring {

using common::Reached;

/// The step could not be completed: the state is as before the step.
class StepFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// One spring. A step depends only on the state, the inputs and its size: repeated from the same saved state it is
/// bit-identical.
class Spring {
 public:
  /// @throws std::invalid_argument naming the parameter, its value and what is allowed
  explicit Spring(const Parameters& parameters);
  Spring(const Spring&) = delete;
  Spring& operator=(const Spring&) = delete;

  /// Whether the law inside makes the contact force, from now on, or the input is it.
  void set_contact_law(ContactLaw law) { parameters_.contact_law = law; }

  /// Advance by `size` [s] > 0, finite, from `time`. The work is bounded: a step that spans too much of the motion is
  /// refused.
  /// @throws StepFailure (state unchanged)
  void step(double size, const Inputs& inputs, double time = 0.0) { step_to_event(size, inputs, time, false); }

  /// Makes a step, if `to_event` only to the first event after its start: contact begins or ends, the top meets the
  /// foundation or leaves it. What happens there is due in strike() or at the start of the next step.
  Reached step_to_event(double size, const Inputs& inputs, double time, bool to_event);
  /// Falling onto the foundation inside: rebound, or come to rest, at `time`, under the inputs as observed.
  void strike(double time);

  /// Take `inputs` as acting at the present instant, for acceleration(), reaction() and contact_energy() before the
  /// first step or after an input has jumped. The motion does not depend on it.
  void observe(const Inputs& inputs) { observe(Loads::from(parameters_, inputs)); }

  /// Instantaneous upward impulse J [N·s]: z += J/m.
  void apply_impulse(double impulse);

  double displacement() const { return state_.y; }                      ///< y [m]
  double velocity() const { return state_.z; }                          ///< z [m/s]
  double displacement_integral() const { return state_.integral; }      ///< ∫ y dτ over the last step [m·s]
  double displacement_integral_2() const { return state_.integral_2; }  ///< ∫∫ y dτ dτ over the last step [m·s²]
  double stop_force() const { return state_.stop_force; }         ///< mean of N over the last step, law inside [N]
  double stop_impulse() const { return state_.stop_impulse; }     ///< sum of stop impulses over the last step [N·s]
  double dissipated_energy() const { return state_.dissipated; }  ///< by α_s and χ since the start [J]
  double load_work() const { return state_.load_work; }           ///< of f_s and −m a since the start [J]
  double impact_loss() const { return state_.impact_loss; }       ///< in stop impacts since the start [J]
  /// Held on the foundation by the law inside, under the inputs at the end of the last step, or as observed since.
  bool seated() const;
  double internal_steps() const { return state_.steps; }            ///< of flights, since the start
  int impacts() const { return static_cast<int>(state_.impacts); }  ///< on the foundation inside, since the start
  double last_impact() const { return state_.last_impact; }         ///< when [s]; −1: there was none
  double kinetic_energy() const;                                    ///< ½ m z² [J]
  double potential_energy() const;  ///< ½ k1 (y − y₀)² + ¼ k2 (y − y₀)⁴ [J]
  double spring_force() const;      ///< k1 (y − y₀) + k2 (y − y₀)³ [N]
  // Under the inputs at the end of the last step, or as observed since:
  double acceleration() const;  ///< ż [m/s²]
  /// Its rate [m/s³], with F at `force_rate` and C of the law inside at `reaction_rate` [N/s].
  double jerk(double force_rate, double reaction_rate) const;
  double reaction() const;                     ///< C of the law inside [N]; 0 for external
  Compliance::Slopes reaction_slopes() const;  ///< of it
  double elastic_reaction() const { return equation_.compliance().elastic(depth()); }  ///< λ_nc (y − u_tip)₊^p [N]
  double contact_energy() const;  ///< λ_nc (y − u_tip)₊^{p+1}/(p+1) of the law inside [J]
  const Polynomial& tip() const { return state_.observed.tip; }  ///< u_tip [m], its rates

  /// The whole dynamic state: all that a step changes, in doubles.
  struct State {
    double y, z;
    double integral = 0.0, integral_2 = 0.0;
    double dissipated = 0.0, impact_loss = 0.0, load_work = 0.0;
    double stop_force = 0.0, stop_impulse = 0.0;
    double seated = 0.0;  ///< 1 on the foundation, where nothing says otherwise since
    double impacts = 0.0, last_impact = -1.0;
    double steps = 0.0;    ///< internal ones, since the start
    double meeting = 0.0;  ///< 1: the last step ended early where contact begins or ends
    /// What acts at the present instant, where the step ended or as observed. No step depends on it.
    struct Observed {
      double force;    ///< F [N]
      Polynomial tip;  ///< u_tip [m], its rates
    } observed{};
  };
  const State& state() const { return state_; }
  /// @pre the state is of a spring with the same parameters
  void restore(const State& state) { state_ = state; }

 private:
  class Step;
  void observe(const Loads& loads) { state_.observed = {loads.force[0], loads.tip}; }
  bool can_rest() const { return parameters_.stop_enabled && state_.y == parameters_.stop_position && state_.z == 0.0; }
  double depth() const { return parameters_.compliant() ? state_.y - tip()[0] : -1.0; }
  bool finite() const;

  Parameters parameters_;
  const EquationOfMotion equation_;
  Flight flight_;
  State state_;
};

}  // namespace spring
