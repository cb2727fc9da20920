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
#include <cstddef>
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

  /// Where the top would be [m] after a step of H under a force [N] held over it; NaN if it cannot make that step.
  using Top = std::function<double(double)>;

  /// Before the first step, whenever `seen` changes: choose its force, the top being at y. w then stands for the first
  /// step's mean velocity, too. `initial`: `seen` are start values, not yet a message. Zeros where the start values
  /// are others are no message either: the tool has nothing to pass on yet, and as it does not pass the force on, that
  /// is 0 over the first step.
  void begin(const TipMessage& seen, bool initial, double y, const Top& top);

  /// A step was made under force(), at whose start the tip was `seen`, and the top is at y: choose the next force.
  void advance(const TipMessage& seen, double y, const Top& top);

  /// C over the next step [N]; not finite if none was found, or where the tip goes leaves the range of numbers.
  double force() const { return now_.force; }
  double elastic(double y) const { return law_.elastic(y - now_.tip); }  ///< Φ' [N]
  double energy(double y) const { return law_.energy(y - now_.tip); }    ///< Φ [J]
  double dissipated() const { return now_.dissipated; }                  ///< by the contact since the start [J]
  double size() const { return size_; }                                  ///< H [s]
  bool started() const { return now_.steps > 0.0; }                      ///< a step was made

  /// What a tip that does not come where it was foreseen tells. With the connections right it comes there to rounding,
  /// but where a load on the beam changes.
  enum Miss : std::size_t {
    elsewhere,  ///< by a good part of a step's way
    late,       ///< where it would be under the forces of the next steps: values pass one after the other
    swapped,    ///< where it would be with r₁ for r₂
    untold,     ///< where it would be without the force of the first step, or nothing was said before that
    kinds
  };
  const std::array<int, kinds>& missed() const { return missed_; }  ///< steps so far, by kind; no part of the state

  /// The whole state: all that a step changes, in doubles.
  struct State {
    double tip = 0.0, next = 0.0;        ///< u_tip now and after the coming step [m]
    double force = 0.0;                  ///< over that step [N]
    double depth = 0.0;                  ///< y − u_tip now [m]
    double dissipated = 0.0;             ///< [J]
    TipMessage given, first;             ///< start values; what was seen before the first step
    double steps = 0.0;                  ///< made, 3 for more
    double said = 0.0, said_next = 0.0;  ///< the tip now and after the coming step as said, without forces [m]
    double last = 0.0, before = 0.0;     ///< forces over the last two steps [N]
  };
  const State& state() const { return now_; }
  void restore(const State& state) { now_ = state; }

 private:
  /// Mean of the law's force over a step [N], and its slope by the depth at the end [N/m].
  struct Mean {
    double force, by_end;
  };
  Mean mean(double start, double end) const;
  void compare(const TipMessage& seen);
  double solve(double start, double free, const Top& top) const;
  void send(double force, double free);  ///< the force over the next step; where the tip goes without it

  Compliance law_;
  double yielding_, size_;
  std::array<double, 2> response_;
  State now_;
  std::array<int, kinds> missed_{};
  double reach_ = 0.0;  ///< longest way of the tip in a step so far [m]
};

}  // namespace spring
