#include "wiring.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace spring {
namespace {

struct Description {
  int certain;  ///< after so many steps: a sudden load makes the tip miss in 2, a harmonic one from rest in up to 8
  const char* text;
};
constexpr std::array<Description, Wiring::faults> descriptions{
    {{10,
      "the tip was not where it was predicted, so the contact gains or loses energy. Connect tip_displacement, "
      "tip_velocity, tip_velocity_forecast, tip_response and tip_response_2 of the beam to the inputs of these names "
      "and reaction to its tip_force. Loads on the beam that change much within a step show here, too"},
     {3,
      "the tip was not where it was predicted, but where it is a step later or earlier, or with tip_response and "
      "tip_response_2 swapped: exchange values between the steps only, for both FMUs alike (Jacobi), or delay by one "
      "step what is exchanged within a step"},
     {1,
      "no values were exchanged before the first step, or reaction before those of the tip: the tip made it without a "
      "contact force. Exchange before the first step, too, first the five of the tip, or all twice; or give the inputs "
      "these start values"},
     {1,
      "values of the beam's tip arrive, but contact_law = 1: there is no contact. Set contact_law = 2, or connect only "
      "contact_force"},
     {10,
      "the step size changes from step to step in contact, which adds energy. A force is chosen for a step of the size "
      "of the last one: keep the size"},
     {1,
      "tip_velocity_forecast arrives, but tip_response and tip_response_2 do not: the contact force is exchanged only "
      "after the steps, which adds energy. Connect tip_response and tip_response_2 of the beam to the inputs of these "
      "names: then no step size adds any. Without them take steps of at most about "}}};

}  // namespace

/// The tip was predicted (held_contact.hpp) at u + 2H w + C₂ r₂ + C₁ r₁, C₁ the force of the step before this one and
/// C₂ that of the step before that. Where forces act a step early, as values are exchanged within the steps, it is at
///     … + C₁ r₂ + C r₁, C that of this step: off by r₂ (C₁ − C₂) + r₁ (C − C₁);
/// with the responses swapped it is at … + C₂ r₁ + C₁ r₂, off by (r₂ − r₁) (C₁ − C₂).
void Wiring::check_step(const HeldContact& contact, const TipMessage& arrived) {
  // Parts of the tip's path in a step: more than rounding, and more than loads within a step cause. Part of the error
  // that no cause explains.
  constexpr double rounding = 1e-6, noticeable = 0.05, unexplained = 0.01;
  const HeldContact::State& state = contact.state();
  stored_ = std::max(stored_, contact.energy(state.tip + state.depth));
  path_ = std::max({path_, state.size * std::abs(arrived.forecast), arrived.response * state.force});
  const double missed = arrived.displacement - state.tip, miss = std::abs(missed);
  if (state.known == 0.0) {
    if (-state.debt > stored_) count(unsteady);
  } else if (contact.first_force_missed(arrived)) {
    count(no_first_exchange);
  } else if (miss > rounding * path_) {
    const double r1 = arrived.response, r2 = arrived.response_2, change = state.last - state.before;
    const auto explains = [&](double by) { return std::abs(missed - by) < unexplained * miss; };
    if (explains(r2 * change + r1 * (state.force - state.last)) || explains((r2 - r1) * change))
      count(shifted);
    else if (miss > noticeable * path_)
      count(elsewhere);
  }
}

void Wiring::check_resolved(double size, double stiffness, double mass) {
  // A force that lags by half a step adds π/2 ωH of the energy to each contact, ω² = C'/m at least: less than 1 %.
  constexpr double resolved = 1e-3;
  const double needed = resolved / std::sqrt(stiffness / mass);
  char text[16];
  std::snprintf(text, sizeof text, "%.0e s", needed);
  if (size > needed) count(unresolved, text);
}

void Wiring::count(Fault fault, const std::string& detail) {
  if (++shown_[fault] == descriptions[fault].certain) news = descriptions[fault].text + detail;
}

int Wiring::warnings() const {
  int count = 0;
  for (std::size_t i = 0; i < faults; ++i)
    if (shown_[i] >= descriptions[i].certain) count += shown_[i];
  return count;
}

}  // namespace spring
