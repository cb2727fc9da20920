#include "wiring.hpp"

#include <algorithm>
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
      "the tip was not where it was predicted, so the contact gains or loses energy. Connect tip_displacement and "
      "tip_velocity_forecast of the beam to the inputs of these names and reaction to its tip_force; set "
      "communication_step in both to the step size, tip_response and tip_response_2 to the beam's. Loads on the beam "
      "that change much within a step show here, too"},
     {3,
      "the tip was not where it was predicted, but where it is a step later or earlier: exchange values between "
      "the steps only, for both FMUs alike (Jacobi), or delay what is exchanged within a step by one step"},
     {3, "the tip was not where it was predicted: tip_response and tip_response_2 are swapped"},
     {1,
      "no values were exchanged before the first step (or an impulse acted on the beam): the tip made it without a "
      "contact force, which adds energy. Exchange values before the first step, too"},
     {1,
      "values of the beam's tip arrive or communication_step is set, but contact_law = 1: there is no contact. Set "
      "contact_law = 2, or connect only contact_force"},
     {1,
      "tip_velocity_forecast arrives but is not used, as communication_step = 0: a contact that the steps do not "
      "resolve gains energy. Set communication_step, tip_response and tip_response_2 to those of the beam, or "
      "communication_step of the beam to 0"}}};

// Parts of the tip's path in a step: what rounding leaves of it, what a load that changes within a step adds, and what
// only a step without the contact force does.
constexpr double rounding = 1e-6, noticeable = 0.05, most = 0.75;
// By how much nearer the tip is to where it would be without the first force, whose prediction is a guess, too.
constexpr double nearer = 0.5;
// An explanation holds if it leaves no more than this part of the miss.
constexpr double unexplained = 0.01;

}  // namespace

void Wiring::check_start(const HeldContact& contact, const TipMessage& arrived) {
  shown_[no_first_exchange] = contact.unanswered(arrived) ? 1 : 0;
}

void Wiring::check_step(const HeldContact& contact, const TipMessage& arrived) {
  if (!contact.started()) return;
  const HeldContact::State& state = contact.state();
  const auto [r1, r2] = contact.response();
  path_ = std::max({path_, contact.size() * std::abs(arrived.velocity), r1 * state.force});
  const auto distance = [&arrived](double tip) { return std::abs(arrived.displacement - tip); };
  const double miss = distance(state.tip);
  if (state.steps < 2.0) {  // the first step's mean velocity was a guess
    const bool without_force = distance(state.tip - r1 * state.last) < nearer * miss;
    if (miss > most * path_ && without_force) shown_[no_first_exchange] = 1;
    return;
  }
  if (miss <= rounding * path_) return;
  const auto explains = [&](double tip) { return distance(tip) < unexplained * miss; };
  if (state.steps < 3.0 && explains(state.free + r1 * state.last))
    shown_[no_first_exchange] = 1;  // it has met the second force, but not the first
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

const char* Wiring::news() {
  const char* text = nullptr;
  for (std::size_t i = 0; i < faults; ++i)
    if (shown_[i] >= descriptions[i].certain && !std::exchange(reported_[i], true)) text = descriptions[i].text;
  return text;
}

}  // namespace spring
