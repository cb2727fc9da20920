// Normal compliance for tools that exchange values only between steps. Over a step of size H the contact force is held
// constant, for both bodies alike (action = reaction), at the value that does the work of the law:
//     C = [Φ(δ⁺) − Φ(δ)]/(δ⁺ − δ) · [1 + χ (δ⁺ − δ)/H]₊,   δ = y − u_tip,   Φ(δ) = λ δ₊^{p+1}/(p+1)
// (docs/coupling.md); with a damper c instead, ([Φ(δ⁺) − Φ(δ)]/(δ⁺ − δ) + c (δ⁺₊ − δ₊)/H)₊. For χ = c = 0 it dissipates
// nothing, else C (δ⁺ − δ) − [Φ(δ⁺) − Φ(δ)] ≥ 0. It is sent at the step's start, before the tip's displacement there
// arrives: the last message is a step older. That is enough, because the beam is linear: it predicts its tip without a
// force, u + 2H w two steps ahead, and
//     u_tip⁺ = u + 2H w + C₋ r₂ + C r₁,
// C₋ the force meanwhile, r₁ and r₂ what 1 N held over a step adds to u_tip at its end and a step later.
// That is so for steps of one size. In the first step, and until two steps after a change of size, the prediction is an
// interpolation: C has then done other work than the law's, and the difference is known once the tip arrives. The
// contact owes it, and the next forces give it back: the energy of the pair stays.
#pragma once

#include <functional>
#include <limits>

#include "compliance.hpp"

namespace spring {

/// What the beam sends, for steps of the size H of its last one.
struct TipMessage {
  double displacement = 0.0, velocity = 0.0;  ///< u [m], u̇ [m/s] of the tip now
  double forecast = 0.0;                      ///< w: mean velocity over the next two steps without a force [m/s]
  double response = 0.0, response_2 = 0.0;    ///< r₁, r₂ [m/N]; r₁ = 0: nothing is known of what comes
  bool predicts() const { return response > 0.0; }
};

class HeldContact {
 public:
  /// `mass` of the spring [kg] > 0.
  HeldContact(const Compliance& law, double mass) : law_(law), mass_(mass) {}

  /// Where the top would be [m] after a step of H under a force [N] held over it; NaN if it cannot make that step. The
  /// last call has the force that is chosen.
  using Top = std::function<double(double)>;

  /// Before the first step, whenever the message changes: choose the force of this step, which is to have the `size` H
  /// [s], the top being at y.
  /// @pre arrived.predicts()
  void begin(const TipMessage& arrived, double size, double y, const Top& top);
  /// After steps without a message: hold the `force` [N] that was sent at their end, the tip being left at `tip`.
  void take_over(double tip, double size, double y, double force);

  /// After a step of `size` under force(), with the message that `arrived` at its start and the top at y: choose the
  /// next force, for a step of the same size.
  void advance(const TipMessage& arrived, double size, double y, const Top& top);

  /// Whether the tip, as it has `arrived` after two steps, is where it is without the force of the first one.
  bool first_force_missed(const TipMessage& arrived) const;

  /// C over the next step [N]; not finite if none was found, or where the tip goes leaves the range of numbers.
  double force() const { return now_.none != 0.0 ? std::numeric_limits<double>::infinity() : now_.force; }
  double elastic(double y) const { return law_.elastic(y - now_.tip); }  ///< Φ' [N]
  /// What the contact's force has stored [J]: Φ, and what it owes.
  double energy(double y) const { return law_.energy(y - now_.tip) + now_.debt; }
  /// The energy with the tip as it has `arrived` [m], where the last step has left it: to where it was predicted that
  /// step's force did the rest of its work.
  double energy(double y, double arrived) const { return energy(y) + now_.last * (now_.tip - arrived); }
  double dissipated() const { return now_.dissipated; }  ///< by the contact since the start [J]
  bool held() const { return now_.held != 0.0; }         ///< a force is: a message has arrived
  bool started() const { return now_.steps > 0.0; }      ///< a step was made

  /// The whole state: all that a step changes, in doubles.
  struct State {
    double held = 0.0;                   ///< 1 from the first message on
    double none = 0.0;                   ///< 1: no force was found, and nothing else but `tip` is known
    double size = 0.0;                   ///< H, of the step that is expected [s]
    double tip = 0.0, next = 0.0;        ///< u_tip now and after the coming step [m]
    double known = 0.0, foreseen = 0.0;  ///< 1 where these are exact, of `next` if the step has the size H
    double force = 0.0, damping = 0.0;   ///< over that step, and what damping has added to it [N]
    double depth = 0.0;                  ///< y − u_tip now [m]
    double debt = 0.0;                   ///< what the force has stored, less Φ [J]
    double dissipated = 0.0;             ///< [J]
    double steps = 0.0;                  ///< made, 3 for more
    double last = 0.0, before = 0.0;     ///< forces over the last two steps [N]
    double start = 0.0, path = 0.0;      ///< where the last step found the tip, and its path in the one before it [m]
    double yielding = 0.0;               ///< what 1 N more takes from the depth at a step's end [m/N]
  };
  const State& state() const { return now_; }
  void restore(const State& state) { now_ = state; }

 private:
  /// Mean of the law's force over a step [N], its slope by the depth at the end [N/m], its rounding and the part that
  /// damping adds [N].
  struct Mean {
    double force, by_end, rounding, damping;
  };
  Mean mean(double start, double end) const;
  /// A force [N] and the depth at the end of a step under it [m].
  struct Found {
    double force, end;
  };
  Found solve(double start, double free, const Top& top);
  double solve_affine(double start, double end, double force) const;
  void choose(double free, const Top& top);
  double repaying(const Found& law) const;

  Compliance law_;
  double mass_;
  double response_ = 0.0;  ///< r₁ of the step that is being solved for [m/N]
  State now_;
};

}  // namespace spring
