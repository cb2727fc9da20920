// Trial steps of a spring under one contact force after the other, by which a held contact finds its force
// (held_contact.hpp). The trial under the force that is found is then the next step.
#pragma once

#include <optional>
#include <string>

#include "spring.hpp"

namespace spring {

class TrialSteps {
 public:
  explicit TrialSteps(Spring& spring) : spring_(spring) {}

  /// From the spring's present state, over `size` [s], under the other `inputs` at the start of the step.
  void begin(double size, const Inputs& inputs);
  /// y after a step under a contact force [N] held over it; NaN if there is no such step. The spring stays as it is.
  double displacement_under(double contact_force);
  /// Why the last step of a series could not be made; empty if all could.
  const std::string& failure() const { return failure_; }

  /// Make the last trial the step, if it had this size, these inputs, the present state at its start, and no impacts,
  /// whose times a trial does not know.
  /// @return whether it did; if not, nothing has changed
  bool adopt(double size, const Inputs& inputs);

 private:
  Spring& spring_;
  Spring::State start_{};
  double size_ = 0.0;
  Inputs inputs_;
  std::optional<Spring::State> end_;  ///< of the last trial, if there was such a step
  double work_ = 0.0;
  std::string failure_;
};

}  // namespace spring
