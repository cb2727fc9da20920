// Normal compliance for tools that exchange values only between steps. Over a step the contact force is held constant,
// for both bodies alike (action = reaction), and it is chosen so that it does the work of the law:
//     C = [Φ(δ⁺) − Φ(δ)]/(δ⁺ − δ),   δ = y − u_tip,   Φ(δ) = λ δ₊^{p+1}/(p+1)          (design.md section 4, d = 0).
// δ⁺ is predicted: the spring by its acceleration, the tip as a mass m_tip under C and the acceleration that the rest
// of the beam gave it over the step before.
#pragma once

#include <array>
#include <cstddef>

#include "compliance.hpp"

namespace spring {

class HeldContact {
 public:
  /// `mass` of the spring, `tip_mass` [kg] > 0 of the beam; `late`: the other side reads the force before this one
  /// learns where the tip is, so that the force is chosen from the predicted tip.
  HeldContact(const Compliance& law, double mass, double tip_mass, bool late)
      : law_(law), mass_(mass), tip_mass_(tip_mass), late_(late) {}

  /// Where the tip is now [m, m/s].
  void see(double displacement, double velocity);

  /// Choose the force for the next step, taken to be as long as the last. `acceleration`: the spring's without C;
  /// `held`: seated on the foundation.
  void choose(double y, double z, double acceleration, bool held);

  /// Whether choose() is due once the tip was seen.
  bool follows_the_tip() const { return !late_ || size_ == 0.0; }

  /// A step of `size` [s] was made under force().
  void advance(double size);

  double force() const { return force_; }                                         ///< C [N]
  double energy(double y) const { return law_.energy(y - u_); }                   ///< Φ [J]

  static constexpr std::size_t state_length = 7;
  std::array<double, state_length> state() const { return {u_, v_, free_, force_, size_, v_before_, force_before_}; }
  void restore(const double* state);

 private:
  Compliance law_;
  double mass_, tip_mass_;
  bool late_;
  double u_ = 0.0, v_ = 0.0;  ///< the tip now, seen or predicted
  double free_ = 0.0;         ///< its acceleration without C
  double force_ = 0.0;
  double size_ = 0.0;                           ///< of the last step, 0 if there was none
  double v_before_ = 0.0, force_before_ = 0.0;  ///< at its start, over it
};

}  // namespace spring
