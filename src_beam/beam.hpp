// The viscoelastic (Kelvin–Voigt) Timoshenko beam, clamped at x = 0, loaded at its tip x = L by the contact force C.
// Semi-discrete form:  M q̈ + α_b K q̇ + K q = e C(t) + F,   q = (θ₁,u₁, …, θₙ,uₙ) for elements of degree 1,  e picks
// u(L). Ahn & Tate, eqs. (1)–(5), (59).  Up is positive; C > 0 lifts the tip.
#pragma once

#include <array>
#include <memory>
#include <vector>

namespace beam {

// An int, so that whatever an FMU parameter says reaches the check.
enum class Integrator : int { modal = 1, generalized_alpha = 2 };  // NOLINT(performance-enum-size)

/// All in SI units; defaults are the unit beam of the paper's section 3.
struct Parameters {
  double density = 1.0;                ///< ρ [kg/m³]
  double area = 1.0;                   ///< A [m²]
  double second_moment_of_area = 1.0;  ///< I [m⁴]
  double young_modulus = 1.0;          ///< E [Pa]
  double shear_modulus = 1.0;          ///< G [Pa]
  double shear_coefficient = 1.0;      ///< K [–]
  double length = 1.0;                 ///< L [m]
  double alpha_b = 0.0;                ///< Kelvin–Voigt retardation time [s]
  int n_elements = 50;                 ///< uniform elements
  int element_degree = 1;              ///< polynomial degree of u and θ in an element, 1 … 12; 1 = P1
  int n_modes = 0;                     ///< lowest modes kept by `modal`; 0 = all
  bool reduced_integration = false;    ///< p-point Gauss rule for the shear; false = exact (59)
  Integrator integrator = Integrator::modal;
  double rho_inf = 1.0;                   ///< spectral radius at infinity of generalized-α; 1 = midpoint rule (62)
  double initial_deflection_slope = 0.0;  ///< s in u⁰ = s·x [–]
  double initial_velocity_slope = 0.0;    ///< s in u_t⁰ = s·x [1/s]
  double tip_load_coefficient = 0.0;      ///< coefficient of the last hat function in f_b [N/m]
};

/// Points at which the shape is reported: x = 0, L/20, …, L.
inline constexpr int shape_points = 21;

/// One beam. Every step depends only on the state, the inputs and the step size: repeated from the same saved
/// state it is bit-identical. Not thread-safe per object; objects share nothing.
class Beam {
 public:
  /// @throws std::invalid_argument naming the parameter, its value and what is allowed
  /// @throws std::runtime_error if the eigensolver does not converge
  explicit Beam(const Parameters& parameters);
  ~Beam();
  Beam(Beam&&) noexcept;
  Beam& operator=(Beam&&) noexcept;

  /// Advance by `size` [s] > 0 under C(τ) = c[0] + c[1] τ + c[2] τ²/2 [N, N/s, N/s²], τ from the step's start,
  /// and the uniform load `distributed_load` [N/m].
  /// @throws std::invalid_argument for a step size that is not finite and > 0, or an input that is not finite
  /// @throws std::domain_error (state unchanged) if the result is not finite
  void step(double size, const std::array<double, 3>& tip_force, double distributed_load);

  /// Instantaneous upward impulse J [N·s] at the tip: v += M⁻¹ e J.
  void apply_tip_impulse(double impulse);

  /// The uniform load [N/m] that `load_potential` and `tip_acceleration` refer to until the next step brings its own.
  void set_distributed_load(double distributed_load);

  double tip_displacement() const;             ///< u(L) [m]
  double tip_velocity() const;                 ///< u_t(L) [m/s]
  double tip_acceleration() const;             ///< u_tt(L) [m/s²] at the end of the last step, under its loads
  double tip_rotation() const;                 ///< θ(L) [rad]
  double tip_displacement_integral() const;    ///< ∫ u dτ over the last step [m·s], 0 at its start
  double tip_displacement_integral_2() const;  ///< ∫∫ u dτ dτ over the last step [m·s²], 0 at its start
  double kinetic_energy() const;               ///< [J]
  double strain_energy() const;                ///< [J]
  double dissipated_energy() const;            ///< work of the Kelvin–Voigt damping force since the start [J]
  double load_potential() const;               ///< −(work form) of f_b: −qᵀF [J], for the load of the last step
  double tip_mass() const;                     ///< 1/(eᵀ M⁻¹ e) [kg]
  double static_tip_compliance() const;        ///< u(L) per unit static tip force [m/N]
  void deflection(std::array<double, shape_points>& u) const;    ///< [m]
  void rotation(std::array<double, shape_points>& theta) const;  ///< [rad]

  /// How the tip goes on over two steps of `size` [s] without a tip force.
  struct Forecast {
    double velocity;      ///< w = [u(t + 2·size) − u(t)]/(2·size) [m/s]
    double acceleration;  ///< its rate, [u_t(t + 2·size) − u_t(t)]/(2·size) [m/s²]
  };
  /// By two trial steps, which leave no trace.
  /// @throws std::invalid_argument as step() does
  /// @throws std::domain_error (state unchanged) if the result is not finite
  Forecast forecast(double size, double distributed_load);

  /// What 1 N held over a step of `size` [s] adds to u(L) at that step's end, and at the end of another step without a
  /// force [m/N]. As the beam is linear, forces C₁, C₂ over the next two steps lead to
  ///     u(t + 2·size) = u(t) + 2·size·w + C₁ r[1] + C₂ r[0].
  /// @throws as forecast()
  std::array<double, 2> tip_response(double size);

  /// Natural frequencies of what is integrated, ascending [rad/s]; empty for generalized_alpha.
  std::vector<double> frequencies() const;

  /// The whole dynamic state as a flat vector of fixed length (for one parameter set).
  void save(std::vector<double>& state) const;
  /// @throws std::invalid_argument if the length does not fit; the state is then unchanged
  void restore(const std::vector<double>& state);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace beam
