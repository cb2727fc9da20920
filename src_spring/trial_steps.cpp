#include "trial_steps.hpp"

#include <cstddef>
#include <cstring>
#include <limits>

namespace spring {
namespace {

constexpr double most_work = 250'000.0;  ///< internal steps for one force, as for one step (spring.cpp)

/// Whether steps from both go on alike: what is observed has no part in that.
bool same_start(const Spring::State& a, const Spring::State& b) {
  return std::memcmp(&a, &b, offsetof(Spring::State, observed)) == 0;
}

}  // namespace

void TrialSteps::begin(double size, const Inputs& inputs) {
  start_ = spring_.state();
  inputs_ = inputs;
  size_ = size;
  end_.reset();
  work_ = 0.0;
  failure_.clear();
}

double TrialSteps::displacement_under(double contact_force) {
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  end_.reset();
  if (work_ > most_work) return unknown;
  inputs_.contact_force = {contact_force, 0.0, 0.0};
  try {
    spring_.step(size_, inputs_);
  } catch (const StepFailure& e) {
    failure_ = e.what();
    return unknown;
  }
  end_ = spring_.state();
  work_ += end_->steps - start_.steps;
  spring_.restore(start_);
  return end_->y;
}

bool TrialSteps::adopt(double size, const Inputs& inputs) {
  if (!end_ || size != size_ || !(inputs == inputs_) || end_->impacts != start_.impacts ||
      !same_start(spring_.state(), start_))
    return false;
  spring_.restore(*end_);
  return true;
}

}  // namespace spring
