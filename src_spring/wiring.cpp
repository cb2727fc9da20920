#include "wiring.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

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
      "and reaction to its tip_force; step both FMUs alike. Loads on the beam that change much within a step show "
      "here, "
      "too"},
     {3,
      "the tip was not where it was predicted, but where it is a step later or earlier: exchange values between "
      "the steps only, for both FMUs alike (Jacobi), or delay what is exchanged within a step by one step"},
     {3, "the tip was not where it was predicted: tip_response and tip_response_2 are swapped"},
     {1,
      "no values were exchanged before the first step: the tip made it without a contact force. Exchange values before "
      "the first step, too, or give the inputs these start values"},
     {1,
      "values of the beam's tip arrive, but contact_law = 1: there is no contact. Set contact_law = 2, or connect only "
      "contact_force"},
     {10,
      "the step size changes from step to step in contact, which adds energy. A force is chosen for a step of the size "
      "of "
      "the last one: keep the size"},
     {1,
      "tip_velocity_forecast arrives, but tip_response and tip_response_2 do not: the contact force is exchanged only "
      "after the steps, which adds energy. Connect tip_response and tip_response_2 of the beam to the inputs of these "
      "names: then no step size adds any. Without them take steps of at most about "}}};

// Parts of the tip's path in a step: what rounding leaves of it, and what a load that changes within a step adds.
constexpr double rounding = 1e-6, noticeable = 0.05;
// An explanation holds if it leaves no more than this part of the miss.
constexpr double unexplained = 0.01;
// A force that lags by half a step adds π/2 ωH of the energy to each contact, ω² = C'/m at least: less than 1 %.
constexpr double resolved = 1e-3;

/// To one digit.
std::string rounded(double value) {
  char text[16];
  return {text, std::to_chars(text, text + sizeof text, value, std::chars_format::scientific, 0).ptr};
}

}  // namespace

void Wiring::check_step(const HeldContact& contact, const TipMessage& arrived) {
  const HeldContact::State& state = contact.state();
  stored_ = std::max(stored_, contact.energy(state.tip + state.depth));
  if (state.known == 0.0) {
    if (-state.debt > stored_) count(unsteady);
    return;
  }
  const double r1 = arrived.response, r2 = arrived.response_2;
  path_ = std::max({path_, state.size * std::abs(arrived.forecast), r1 * state.force});
  const auto distance = [&arrived](double tip) { return std::abs(arrived.displacement - tip); };
  const double miss = distance(state.tip);
  if (miss <= rounding * path_) return;
  const auto explains = [&](double tip) { return distance(tip) < unexplained * miss; };
  if (contact.first_force_missed(arrived))
    shown_[no_first_exchange] = 1;
  else if (explains(state.free + r2 * state.last + r1 * state.force))
    count(late);
  else if (explains(state.free + r1 * state.before + r2 * state.last))
    count(swapped);
  else if (miss > noticeable * path_)
    count(elsewhere);
}

int Wiring::warnings() const {
  int count = 0;
  for (std::size_t i = 0; i < faults; ++i)
    if (shown_[i] >= descriptions[i].certain) count += shown_[i];
  return count;
}

void Wiring::check_resolved(double size, double stiffness, double mass) {
  const double needed = resolved / std::sqrt(stiffness / mass);
  if (size <= needed) return;
  resolving_ = needed;
  shown_[unresolved] = 1;
}

std::string Wiring::news() {
  for (std::size_t i = 0; i < faults; ++i) {
    if (shown_[i] < descriptions[i].certain || std::exchange(reported_[i], true)) continue;
    return descriptions[i].text + (i == unresolved ? rounded(resolving_) + " s" : "");
  }
  return {};
}

}  // namespace spring
