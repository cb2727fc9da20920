// Normal compliance for tools that exchange values only between steps. Over a step of size H the contact force is held
// constant, for both bodies alike (action = reaction), at the value that does the work of the law:
//     C = [Φ(δ⁺) − Φ(δ)]/(δ⁺ − δ) · [1 + χ (δ⁺ − δ)/H]₊,   δ = y − u_tip,   Φ(δ) = λ δ₊^{p+1}/(p+1)
// (docs/coupling.md). For χ = 0 it dissipates nothing, else C (δ⁺ − δ) − [Φ(δ⁺) − Φ(δ)] ≥ 0.
// It is sent off at the step's start, before the tip is seen there; what is known is what was seen a step earlier. That
// is enough, because the beam is linear: it says how its tip would go on without a force, u + 2H w two steps ahead, and
//     u_tip⁺ = u + 2H w + C₋ r₂ + C r₁,
// C₋ the force meanwhile, r₁ and r₂ what 1 N held over a step adds to u_tip at its end and a step later.
#pragma once

#include <array>
#include <functional>

#include "compliance.hpp"

namespace spring {

/// What the beam says of its tip: displacement u now [m], mean velocity w over the next two steps without a force
/// [m/s].
struct TipMessage {
  double displacement = 0.0, velocity = 0.0;
};

class HeldContact {
 public:
  /// `mass` of the spring [kg] > 0, step `size` H [s] > 0, `response` r₁ ≥ 0, r₂ [m/N].
  /// @throws std::invalid_argument if r₁ is 0
  HeldContact(const Compliance& law, double mass, double size, const std::array<double, 2>& response);

  /// Where the top would be [m] after a step of H under a force [N] held over it; NaN if that is not known or would
  /// take too long: then the last force asked for stays.
  using Top = std::function<double(double)>;

  /// Before the first step, whenever `seen` changes: choose its force, the top being at y. w then stands for the first
  /// step's mean velocity, too. Zeros after other values are no message: the tool has nothing to pass on yet, and as
  /// it does not pass the force on either, that is 0 over the first step.
  void begin(const TipMessage& seen, double y, const Top& top);

  /// A step was made under force(), at whose start the tip was `seen`, and the top is at y: choose the next force.
  void advance(const TipMessage& seen, double y, const Top& top);

  /// C over the next step [N]; not finite if it, or where the tip goes, leaves the range of floating-point numbers.
  double force() const { return now_.force; }
  double energy(double y) const { return law_.energy(y - now_.tip); }  ///< Φ [J]
  double dissipated() const { return now_.dissipated; }                ///< by the contact since the start [J]
  double tip() const { return now_.tip; }                              ///< u_tip now [m], as foreseen
  double size() const { return size_; }                                ///< H [s]
  bool started() const { return now_.steps > 0.0; }                    ///< a step was made

  /// Steps so far that the tip began elsewhere than foreseen, and by how much at most [m]. With the connections right
  /// that is rounding, but in the two steps that a sudden load on the beam takes to be known. No part of the state.
  int missed() const { return missed_; }
  double farthest() const { return farthest_; }

  /// Everything that a step changes; doubles only, see flat.hpp.
  struct State {
    double tip = 0.0, next = 0.0;  ///< u_tip now and after the coming step [m]
    double force = 0.0;            ///< over that step [N]
    double depth = 0.0;            ///< y − u_tip now [m]
    double dissipated = 0.0;       ///< [J]
    TipMessage first;              ///< seen before the first step
    double steps = 0.0;            ///< made, 2 for more
  };
  const State& state() const { return now_; }
  /// @throws std::invalid_argument (state unchanged) if a number that force() does not decide is not finite
  void restore(const State& state);

 private:
  void compare(const TipMessage& seen);
  void choose(double y, double free, const Top& top);
  void send(double force, double free);  ///< the force over the next step; where the tip goes without one
  double root(double start, double free, double yielding) const;
  double held(double start, double end) const;

  Compliance law_;
  double yielding_, size_;
  std::array<double, 2> response_;
  State now_;
  int missed_ = 0;
  double farthest_ = 0.0;
  double reach_ = 0.0;  ///< longest way of the tip in a step so far [m]
};

}  // namespace spring
