// Whether a spring with a contact law inside is connected to its beam as it must be. A pair that is wired wrongly gains
// or loses energy, or has no contact, without another sign.
#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "held_contact.hpp"

namespace spring {

/// Counts the steps in which a fault shows, and names it once there are enough of them.
class Wiring {
 public:
  enum Fault : std::size_t {
    elsewhere,          ///< the tip is not where it was predicted, by a good part of its path in a step
    shifted,            ///< it is where forces a step later or earlier take it, or r₁ for r₂
    no_first_exchange,  ///< it made the first step without the contact force
    no_law,             ///< a tip arrives, but there is no contact law inside
    unsteady,           ///< step sizes change in contact, which adds more than the contact ever stored
    unresolved,         ///< a beam sends a forecast but no responses, in contact that steps must resolve and do not
    faults
  };

  /// At a step's end, before the contact is advanced: the tip as `arrived` at the start of the step.
  void check_step(const HeldContact& contact, const TipMessage& arrived);
  /// After a step of `size` [s] with a law of this `stiffness` [N/m] > 0 inside, under what a beam's forecast says.
  void check_resolved(double size, double stiffness, double mass);
  /// A step in which the fault shows.
  void count(Fault fault, const std::string& detail = {});

  /// Steps in which something is wrong, of faults that are certain.
  int warnings() const;
  std::string news;  ///< what is wrong and what to do, once for each fault; cleared by whoever reports it

 private:
  std::array<int, faults> shown_{};
  double path_ = 0.0;    ///< longest one of the tip in a step so far [m]
  double stored_ = 0.0;  ///< most energy that the contact has stored so far [J]
};

}  // namespace spring
