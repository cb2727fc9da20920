// Normal compliance for tools that exchange values only between steps. Over a step of size H the contact force is held
// constant, for both bodies alike (action = reaction), at the value that does the work of the law:
//     C = [Φ(δ⁺) − Φ(δ)]/(δ⁺ − δ) · [1 + χ (δ⁺ − δ)/H]₊,   δ = y − u_tip,   Φ(δ) = λ δ₊^{p+1}/(p+1)
// (docs/coupling.md). For χ = 0 it dissipates nothing, else C (δ⁺ − δ) − [Φ(δ⁺) − Φ(δ)] ≥ 0.
// It is sent at the step's start, before the tip's displacement there arrives: the last message is a step older. That
// is enough, because the beam is linear: it predicts its tip without a force, u + 2H w two steps ahead, and
//     u_tip⁺ = u + 2H w + C₋ r₂ + C r₁,
// C₋ the force meanwhile, r₁ and r₂ what 1 N held over a step adds to u_tip at its end and a step later.
#pragma once

#include <array>
#include <functional>

#include "compliance.hpp"

namespace spring {

/// The beam's message: displacement u of its tip now [m], mean velocity w over the next two steps without a force
/// [m/s].
struct TipMessage {
  double displacement = 0.0, velocity = 0.0;
};

class HeldContact {
 public:
  /// `mass` of the spring [kg] > 0, step `size` H [s] > 0, `response` r₁ ≥ 0, r₂ [m/N].
  /// @throws std::invalid_argument if r₁ is 0
  HeldContact(const Compliance& law, double mass, double size, const std::array<double, 2>& response);

  /// Where the top would be [m] after a step of H under a force [N] held over it; NaN if it cannot make that step. The
  /// last call has the force that is chosen.
  using Top = std::function<double(double)>;

  /// Before the first step, whenever the `arrived` message changes: choose the force of this step, the top being at y.
  /// Its mean velocity is taken to be w, too. `initial`: the message has start values. If it is unanswered(), the force
  /// is 0.
  void begin(const TipMessage& arrived, bool initial, double y, const Top& top);
  /// Zeros where the start values are not 0: the tool has not exchanged values yet, so the beam makes the first step
  /// without a force.
  bool unanswered(const TipMessage& arrived) const;

  /// After a step under force(), with the message that `arrived` at its start and the top at y: choose the next force.
  void advance(const TipMessage& arrived, double y, const Top& top);

  /// C over the next step [N]; not finite if none was found, or where the tip goes leaves the range of numbers.
  double force() const { return now_.force; }
  double elastic(double y) const { return law_.elastic(y - now_.tip); }  ///< Φ' [N]
  double energy(double y) const { return law_.energy(y - now_.tip); }    ///< Φ [J]
  double dissipated() const { return now_.dissipated; }                  ///< by the contact since the start [J]
  double size() const { return size_; }                                  ///< H [s]
  const std::array<double, 2>& response() const { return response_; }    ///< r₁, r₂ [m/N]
  bool started() const { return now_.steps > 0.0; }                      ///< a step was made

  /// The whole state: all that a step changes, in doubles.
  struct State {
    double tip = 0.0, next = 0.0;        ///< u_tip now and after the coming step [m]
    double force = 0.0;                  ///< over that step [N]
    double depth = 0.0;                  ///< y − u_tip now [m]
    double dissipated = 0.0;             ///< [J]
    TipMessage given, first;             ///< start values; what arrived before the first step
    double steps = 0.0;                  ///< made, 3 for more
    double free = 0.0, next_free = 0.0;  ///< the tip now and after the coming step, without forces meanwhile [m]
    double last = 0.0, before = 0.0;     ///< forces over the last two steps [N]
    double yielding = 0.0;               ///< what 1 N more takes from the depth at a step's end [m/N]
  };
  const State& state() const { return now_; }
  void restore(const State& state) { now_ = state; }

 private:
  /// Mean of the law's force over a step [N], its slope by the depth at the end [N/m], and its rounding [N].
  struct Mean {
    double force, by_end, rounding;
  };
  Mean mean(double start, double end) const;
  double solve(double start, double free, const Top& top);
  double solve_affine(double start, double end, double force) const;
  void send(double force, double free);  ///< the force over the next step; where the tip goes without it

  Compliance law_;
  double yielding_, size_;  ///< State::yielding of a free top
  std::array<double, 2> response_;
  State now_;
};

}  // namespace spring
