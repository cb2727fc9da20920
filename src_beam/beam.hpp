// The viscoelastic (Kelvin–Voigt) Timoshenko beam, clamped at x = 0, loaded at its tip x = L by the contact force C.
// Semi-discrete form:  M q̈ + α_b K q̇ + K q = e C(t) + F,   q = (θ₁,u₁, …, θₙ,uₙ) for elements of degree 1,  e picks
// u(L). Ahn & Tate, eqs. (1)–(5), (59).  Up is positive; C > 0 lifts the tip.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

namespace beam {

// An int, so that whatever an FMU parameter says reaches the check.
enum class Integrator : int { modal = 1, generalized_alpha = 2 };  // NOLINT(performance-enum-size)
inline constexpr std::array<const char*, 2> integrator_names{"modal", "generalized_alpha"};  ///< numbered from 1

enum class MassMatrix : int { consistent = 1, averaged = 2 };  // NOLINT(performance-enum-size)
inline constexpr std::array<const char*, 2> mass_matrix_names{"consistent", "averaged"};  ///< numbered from 1

/// Highest polynomial degree of an element.
inline constexpr int max_element_degree = 12;
/// Most elements times their degree that a beam may have; bounds memory, not the mathematics.
inline constexpr int max_elements = 1000000;
/// Most unknowns of a dense eigenproblem: of the mesh (two per element and degree) where all modes are wanted, of the
/// reduced basis where some are.
inline constexpr int max_dense_unknowns = 1000;

/// All in SI units; defaults are the unit beam of the paper's section 3.
struct Parameters {
  double density = 1.0;                             ///< ρ [kg/m³]
  double area = 1.0;                                ///< A [m²]
  double second_moment_of_area = 1.0;               ///< I [m⁴]
  double young_modulus = 1.0;                       ///< E [Pa]
  double shear_modulus = 1.0;                       ///< G [Pa]
  double shear_coefficient = 1.0;                   ///< K [–]
  double length = 1.0;                              ///< L [m]
  double alpha_b = 0.0;                             ///< Kelvin–Voigt retardation time [s]
  int n_elements = 50;                              ///< uniform elements
  int element_degree = 1;                           ///< polynomial degree of u and θ in an element, 1 … 12; 1 = P1
  int n_modes = 0;                                  ///< lowest modes kept by `modal`; 0 = all
  bool reduced_integration = false;                 ///< p-point Gauss rule for the shear; false = exact (59)
  MassMatrix mass_matrix = MassMatrix::consistent;  ///< see timoshenko.hpp
  Integrator integrator = Integrator::modal;
  double rho_inf = 1.0;                   ///< spectral radius at infinity of generalized-α; 1 = midpoint rule (62)
  double initial_deflection_slope = 0.0;  ///< s in u⁰ = s·x [–]
  double initial_velocity_slope = 0.0;    ///< s in u_t⁰ = s·x [1/s]
  double tip_load_coefficient = 0.0;      ///< coefficient of the last hat function in f_b [N/m]
};

/// f(τ) = f[0] + f[1] τ + f[2] τ²/2, τ [s] from a step's start: a value and its first two time derivatives there.
using Polynomial = std::array<double, 3>;

inline double value_at(const Polynomial& f, double t) { return f[0] + t * (f[1] + 0.5 * t * f[2]); }
inline double mean_over(const Polynomial& f, double h) { return f[0] + h * (f[1] / 2.0 + h * f[2] / 6.0); }

/// Points at which the shape is reported: x = 0, L/20, …, L.
inline constexpr int shape_points = 21;
using Shape = std::array<double, shape_points>;

/// One beam; make_beam() chooses the integrator behind it. Every step depends only on the state, the inputs and the
/// step size: repeated from the same saved state it is bit-identical. Not thread-safe per object; objects share
/// nothing.
class Beam {
 public:
  virtual ~Beam() = default;
  Beam(const Beam&) = delete;
  Beam& operator=(const Beam&) = delete;

  /// Advance by `size` [s] > 0 under the tip force C [N] and the uniform load f_b [N/m].
  /// @throws std::invalid_argument for a step size that is not finite and > 0, or an input that is not finite
  /// @throws std::domain_error (state unchanged) if the result is not finite
  void step(double size, const Polynomial& tip_force, const Polynomial& distributed_load);
  void step(double size, const Polynomial& tip_force, double distributed_load) {
    step(size, tip_force, Polynomial{distributed_load, 0.0, 0.0});
  }

  /// Instantaneous upward impulse J [N·s] at the tip: v += M⁻¹ e J.
  /// @throws as step()
  void apply_tip_impulse(double impulse);

  /// Take C [N] and f_b [N/m] as acting now, for tip_acceleration() and load_potential(), which otherwise refer to the
  /// end of the last step. The motion does not depend on it.
  void observe(double tip_force, double distributed_load);
  double distributed_load() const { return now_.distributed_load; }  ///< f_b acting now [N/m]

  virtual double tip_displacement() const = 0;                            ///< u(L) [m]
  virtual double tip_velocity() const = 0;                                ///< u_t(L) [m/s]
  virtual double tip_acceleration() const = 0;                            ///< u_tt(L) [m/s²]
  virtual double tip_rotation() const = 0;                                ///< θ(L) [rad]
  double tip_displacement_integral() const { return now_.integral; }      ///< ∫ u dτ over the last step [m·s]
  double tip_displacement_integral_2() const { return now_.integral_2; }  ///< ∫∫ u dτ dτ over it [m·s²]
  virtual double kinetic_energy() const = 0;                              ///< [J]
  virtual double strain_energy() const = 0;                               ///< [J]
  virtual double dissipated_energy() const { return now_.dissipated; }    ///< by α_b since the start [J]
  double load_potential() const;                                          ///< −qᵀF [J] of f_b and the hat load
  virtual double deflection_integral() const = 0;                 ///< ∫ u dx = −∂load_potential/∂f_b [m²]
  virtual double tip_mass() const = 0;                            ///< 1/(eᵀ M⁻¹ e) [kg]
  virtual double static_tip_compliance() const = 0;               ///< u(L) per unit static tip force [m/N]
  virtual void deflection(Shape& u) const = 0;                    ///< [m]
  virtual void rotation(Shape& theta) const = 0;                  ///< [rad]
  virtual std::vector<double> frequencies() const { return {}; }  ///< of the modes, ascending [rad/s]

  /// How the tip goes on over two steps of `size` [s] without a tip force.
  struct Forecast {
    double velocity;      ///< w = [u(t + 2·size) − u(t)]/(2·size) [m/s]
    double acceleration;  ///< its rate, [u_t(t + 2·size) − u_t(t)]/(2·size) [m/s²]
  };
  /// Under the load that load_potential() refers to, by two trial steps, which leave no trace.
  /// @throws as step()
  Forecast forecast(double size);
  /// What 1 N/m of that load adds to the forecast, which is linear in it.
  Forecast forecast_per_load(double size);

  /// What 1 N held over a step of `size` [s] adds to u(L) at that step's end, and at the end of another step without a
  /// force [m/N]. As the beam is linear, forces C₁, C₂ over the next two steps lead to
  ///     u(t + 2·size) = u(t) + 2·size·w + C₁ r[1] + C₂ r[0].
  /// @throws as forecast()
  std::array<double, 2> tip_response(double size);

  /// The whole dynamic state as a flat vector of fixed length (for one parameter set).
  void save(std::vector<double>& state) const;
  /// @throws std::invalid_argument if this is no state of such a beam: its length does not fit or it is not finite
  void require_state(const std::vector<double>& state) const;
  /// @pre require_state(state) passes
  void restore(const std::vector<double>& state);

 protected:
  Beam(const Parameters& parameters, std::size_t motion_size);

  /// Beside the motion, what a state has.
  struct Scalars {
    double integral, integral_2, dissipated;
    double tip_force, distributed_load;  // C [N] and f_b [N/m] at the end of the last step, or as observed since
  };

  /// Makes the step and changes `now_`, but for the loads. Returns a sum of squares of the new motion, see `ordinary`.
  virtual double advance(double size, const Polynomial& tip_force, const Polynomial& distributed_load) = 0;
  virtual void undo() = 0;  ///< takes the last advance() back, but for `now_`
  virtual void strike(double impulse) = 0;
  virtual double hat_work() const = 0;                     ///< ∫ u ψ dx, ψ the tip's hat function [m²]
  virtual void save_motion(double* numbers) const = 0;     ///< motion_size of them
  virtual void restore_motion(const double* numbers) = 0;  ///< likewise

  /// While coefficients, loads and the sum of squares stay below `ordinary` and step sizes below `ordinary_size`, no
  /// output can overflow. Outputs of a step beyond are looked at one by one.
  static constexpr double ordinary = 1e40, ordinary_size = 1e10;
  bool ordinary_ = false;  ///< whether all coefficients stay below

  double hat_;  ///< coefficient of the hat load [N/m]
  mutable Scalars now_{};

 private:
  class Trial;
  bool outputs_finite() const;
  std::size_t motion_size_;
};

/// @throws std::invalid_argument naming the parameter, its value and what is allowed
/// @throws std::runtime_error if the eigensolver does not converge
std::unique_ptr<Beam> make_beam(const Parameters& parameters);

}  // namespace beam
