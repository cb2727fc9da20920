// What the two integrators share: the interface behind `Beam`, the polynomial force, the cache of step sizes.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <vector>

#include "beam.hpp"

namespace beam {

/// C(τ) = c[0] + c[1] τ + c[2] τ²/2 [N].
using TipForce = std::array<double, 3>;

inline double force_at(const TipForce& c, double t) { return c[0] + t * (c[1] + 0.5 * t * c[2]); }
inline double mean_force(const TipForce& c, double h) { return c[0] + h * (c[1] / 2.0 + h * c[2] / 6.0); }

/// One integrator with its state; the functions mean what those of `Beam` of the same name mean.
class BeamIntegrator {
 public:
  virtual ~BeamIntegrator() = default;

  /// @throws std::domain_error (state unchanged) if the result is not finite
  virtual void step(double size, const TipForce& tip_force, double distributed_load) = 0;
  virtual void apply_tip_impulse(double impulse) = 0;
  virtual void set_distributed_load(double distributed_load) = 0;

  virtual double tip_displacement() const = 0;
  virtual double tip_velocity() const = 0;
  virtual double tip_acceleration() const = 0;
  virtual double tip_rotation() const = 0;
  virtual double tip_displacement_integral() const = 0;
  virtual double tip_displacement_integral_2() const = 0;
  virtual double kinetic_energy() const = 0;
  virtual double strain_energy() const = 0;
  virtual double dissipated_energy() const = 0;
  virtual double load_potential() const = 0;
  virtual double tip_mass() const = 0;
  virtual double static_tip_compliance() const = 0;
  virtual void deflection(std::array<double, shape_points>& u) const = 0;
  virtual void rotation(std::array<double, shape_points>& theta) const = 0;
  virtual std::vector<double> frequencies() const = 0;

  virtual void save(std::vector<double>& state) const = 0;
  /// @pre state has the length that save() gives, all of it finite
  virtual void restore(const std::vector<double>& state) = 0;
};

/// While parameters, loads and energies (or the squared norms of q and v) stay below `ordinary` and step sizes below
/// `ordinary_size`, no output can overflow. A step beyond asks outputs_finite().
inline constexpr double ordinary = 1e40, ordinary_size = 1e10;

bool outputs_finite(const BeamIntegrator& beam);

inline bool ordinary_inputs(double size, const TipForce& c, double distributed_load) {
  return size < ordinary_size &&
         std::abs(c[0]) + std::abs(c[1]) + std::abs(c[2]) + std::abs(distributed_load) < ordinary;
}

/// @throws std::domain_error that names the step and what to do about it
[[noreturn]] void throw_not_finite(double size, const TipForce& tip_force, double distributed_load);

/// What depends on the step size alone, kept for the last few sizes: an event is located with other sizes, after
/// which the nominal one costs nothing. A cached value equals the recomputed one bit by bit.
template <typename Value>
class StepCache {
 public:
  /// The value of `size`; if it is not there, of the size not used for longest, made over by `make(size, value)`.
  /// Valid until the next call.
  template <typename Make>
  const Value& get(double size, const Make& make) {
    ++clock_;
    Entry* oldest = &entries_[0];
    for (Entry& entry : entries_) {
      if (entry.size == size) {
        entry.used = clock_;
        return entry.value;
      }
      if (entry.used < oldest->used) oldest = &entry;
    }
    oldest->size = 0.0;  // no step size: a throwing make() must not leave a wrong entry
    make(size, oldest->value);
    oldest->size = size;
    oldest->used = clock_;
    return oldest->value;
  }

 private:
  struct Entry {
    double size = 0.0;
    std::size_t used = 0;
    Value value;
  };
  std::array<Entry, 4> entries_;
  std::size_t clock_ = 0;
};

}  // namespace beam
