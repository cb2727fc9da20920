// The viscoelastic (Kelvin–Voigt) Timoshenko beam, clamped at x = 0, loaded at its tip x = L by the contact force C.
// Semi-discrete form:  M q̈ + α_b K q̇ + K q = e C(t) + F,   q = (θ₁,u₁, …, θₙ,uₙ) for elements of degree 1,  e picks
// u(L), F what the loads below give. Ahn & Tate, eqs. (1)–(5), (59).  Up is positive; C > 0 lifts the tip.
#pragma once

#include <array>
#include <cstddef>
#include <initializer_list>
#include <memory>

#include "../fmus/adapter/common.hpp"
#include "eigen.hpp"

namespace beam {

using common::mean, common::number, common::Polynomial, common::value;

enum class Integrator { modal = 1, midpoint = 2 };
enum class MassMatrix { consistent = 1, averaged = 2 };

/// Highest polynomial degree of an element.
inline constexpr int max_element_degree = 12;
/// Most elements that a beam may have, of degree 1; of degree p fewer by p(p + 1)/2, as a band of its matrices has
/// 4n p(p + 1) values: 64 MB, and an integrator keeps five. Bounds memory, not the mathematics.
inline constexpr int max_elements = 1000000;
/// Most unknowns of a dense eigenproblem: of the mesh (two per element and degree) where all modes are wanted, of the
/// reduced basis where some are.
inline constexpr int max_dense_unknowns = 1000;
/// Most unknowns times modes: the search for modes holds five such arrays, 1 GB.
inline constexpr int max_mode_values = 25'000'000;

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
  int n_modes = 0;                                  ///< lowest modes kept by `modal`; 0 = all of the mesh's
  bool reduced_integration = false;                 ///< p-point Gauss rule for the shear; false = exact (59)
  MassMatrix mass_matrix = MassMatrix::consistent;  ///< see timoshenko.hpp
  Integrator integrator = Integrator::modal;
  double initial_deflection_slope = 0.0;                           ///< s in u⁰ = s·x [–]
  double initial_velocity_slope = 0.0;                             ///< s in u_t⁰ = s·x [1/s]
  std::array<double, 4> point_force_position{0.5, 0.5, 0.5, 0.5};  ///< x/L of the point forces
};

/// The loads on the beam, without the tip force: each has a shape in space and is a polynomial in time. The moving
/// clamp's frame is not inertial: in it the beam is under the uniform load −ρA a.
class Loads {
 public:
  enum Shape : std::size_t {
    distributed = 0,        ///< four of them, f_b = (x/L)^i, i = 0 … 3 [N/m]
    point = 4,              ///< four of them, at point_force_position [N]
    tip = 8,                ///< [N]
    base_acceleration = 9,  ///< a of the clamp [m/s²]
    hat = 10,               ///< f_b = the last hat function [N/m]
    count = 11
  };
  static constexpr std::array<const char*, count> names{
      "distributed_load", "distributed_load_x", "distributed_load_x2", "distributed_load_x3",
      "point_force[1]",   "point_force[2]",     "point_force[3]",      "point_force[4]",
      "tip_load",         "base_acceleration",  "tip_load_coefficient"};
  static bool is_point(std::size_t shape);  ///< or one of those in between
  /// The value of each load at one instant, or its mean.
  using Values = std::array<double, count>;

  Loads() = default;
  Loads(const Polynomial& uniform) { set(distributed, uniform); }  // NOLINT(google-explicit-constructor)
  Loads(double uniform) : Loads(Polynomial{uniform, 0.0, 0.0}) {}  // NOLINT(google-explicit-constructor)

  void set(std::size_t shape, const Polynomial& value) {
    values_[shape] = value;
    const unsigned bit = 1U << shape;
    acting_ = value == Polynomial{} ? acting_ & ~bit : acting_ | bit;
  }
  bool any() const { return acting_ != 0; }  ///< whether one is not 0

  /// Calls use(shape, value) for each that is not 0, in ascending order: the others cost nothing.
  template <class Use>
  void for_each(const Use& use) const {
    for (std::size_t shape = 0; acting_ >> shape != 0; ++shape) {
      if ((acting_ >> shape & 1U) != 0) use(shape, values_[shape]);
    }
  }
  Values at(double t) const {
    Values values{};
    for_each([&](std::size_t shape, const Polynomial& f) { values[shape] = value(f, t); });
    return values;
  }

 private:
  std::array<Polynomial, count> values_{};
  unsigned acting_ = 0;  ///< a bit per shape
};

/// f of a distributed load at x = place·L, of 1 N/m or, of the base acceleration, 1 m/s² [N/m]; exact in an element.
double load_density(const Parameters& parameters, std::size_t shape, double place);
double point_force_place(const Parameters& parameters, std::size_t shape);  ///< x/L, also of the tip load

/// Points at which the shape is reported: x = 0, L/20, …, L.
inline constexpr int shape_points = 21;
using Shape = Eigen::Matrix<double, shape_points, 1>;

/// There, on the part between x and the tip: Q > 0 pulls the part before it up, M > 0 bends the beam upwards.
struct InternalForces {
  Shape shear = Shape::Zero(), moment = Shape::Zero();  ///< Q [N], M [N·m]
};

/// The beam in space, M q̈ + α_b K q̇ + K q = F in unknowns of its kind: of a mesh (timoshenko.hpp) or of modes.
class Discretisation {
 public:
  using Vector = Eigen::Ref<const Eigen::VectorXd>;

  Discretisation() = default;
  virtual ~Discretisation() = default;
  virtual Eigen::VectorXd linear_shape() const = 0;                      ///< u = x, θ = 0
  virtual const Eigen::VectorXd& load(std::size_t shape) const = 0;      ///< F of 1 N/m, 1 N or 1 m/s²
  virtual Eigen::VectorXd mass_solve(const Vector& f) const = 0;         ///< M⁻¹ f
  virtual Eigen::VectorXd stiffness_times(const Vector& q) const = 0;    ///< K q
  virtual Eigen::VectorXd flexibility_times(const Vector& f) const = 0;  ///< K⁻¹ f
  virtual double mass_norm2(const Vector& q) const = 0;                  ///< qᵀMq
  virtual double stiffness_norm2(const Vector& q) const = 0;             ///< qᵀKq, as a sum of squares
  virtual double tip(const Vector& q) const = 0;                         ///< u(L)
  virtual double tip_rotation(const Vector& q) const = 0;                ///< θ(L)
  virtual Shape deflection(const Vector& q) const = 0;                   ///< u
  virtual Shape rotation(const Vector& q) const = 0;                     ///< θ
  virtual InternalForces inertia(const Vector& acceleration) const = 0;  ///< ∫ρA ü ds and ∫(s − x) ρA ü + ρI θ̈ ds

 protected:
  Discretisation(const Discretisation&) = default;
  Discretisation(Discretisation&&) = default;
  Discretisation& operator=(const Discretisation&) = default;
  Discretisation& operator=(Discretisation&&) = default;
};

/// One beam; make_beam() chooses the integrator behind it. Every step depends only on the state, the inputs and the
/// step size: repeated from the same saved state it is bit-identical. Not thread-safe per object; objects share
/// nothing.
class Beam {
 public:
  virtual ~Beam() = default;
  Beam(const Beam&) = delete;
  Beam& operator=(const Beam&) = delete;

  // @pre step sizes, forces and impulses are finite, sizes > 0

  /// Advance by `size` [s] under the tip force C [N] and the loads.
  /// @throws std::domain_error (state unchanged) if the step is too long: a shorter one may be computed
  /// @throws std::overflow_error (state unchanged) if the inputs or the result are too large
  void step(double size, const Polynomial& tip_force, const Loads& loads);

  /// Instantaneous upward impulse J [N·s] at the tip: v += M⁻¹ e J.
  /// @throws as step()
  void apply_tip_impulse(double impulse);

  /// Set the tip force C [N] and the loads that act now, for tip_acceleration() and load_potential(), which otherwise
  /// refer to the end of the last step. The motion does not depend on it.
  void set_forces(double tip_force, const Loads& loads);
  double tip_force() const { return now_.scalars.tip_force; }  ///< that acts now

  double tip_displacement() const { return space_->tip(now_.q); }             ///< u(L) [m]
  double tip_velocity() const { return space_->tip(now_.v); }                 ///< u_t(L) [m/s]
  double tip_acceleration() const { return space_->tip(acceleration()); }     ///< u_tt(L) [m/s²]
  double tip_rotation() const { return space_->tip_rotation(now_.q); }        ///< θ(L) [rad]
  double tip_displacement_integral() const { return now_.scalars.integral; }  ///< ∫ u dτ over the last step [m·s]
  double tip_displacement_integral_2() const { return now_.scalars.integral_2; }  ///< ∫∫ u dτ dτ over it [m·s²]
  double kinetic_energy() const { return 0.5 * space_->mass_norm2(now_.v); }      ///< [J]
  double strain_energy() const { return 0.5 * space_->stiffness_norm2(now_.q); }  ///< [J]
  double dissipated_energy() const { return book(), now_.scalars.dissipated; }    ///< by α_b since the start [J]
  double load_work() const { return book(), now_.scalars.load_work; }             ///< of all loads since the start [J]
  double load_potential() const {
    return potential(now_.scalars.loads, now_.q);
  }  ///< −qᵀF [J] of the uniform and the hat load, as if they were constant
  // Their rates, under what acts now.
  double tip_rotation_rate() const { return space_->tip_rotation(now_.v); }               ///< [rad/s]
  double kinetic_power() const { return now_.v.dot(inertia_force()); }                    ///< [W]
  double strain_power() const { return now_.v.dot(space_->stiffness_times(now_.q)); }     ///< [W]
  double dissipated_power() const { return alpha_b_ * space_->stiffness_norm2(now_.v); }  ///< [W]
  double load_power() const { return force(now_.scalars.loads).dot(now_.v); }             ///< of all loads [W]
  double load_potential_rate(const Loads::Values& loads_rate) const;                      ///< [W]
  double tip_mass() const { return 1.0 / space_->tip(struck_); }                          ///< 1/(eᵀ M⁻¹ e) [kg]
  Shape deflection() const { return space_->deflection(now_.q); }                         ///< [m]
  Shape rotation() const { return space_->rotation(now_.q); }                             ///< [rad]

  /// Quantities that depend without delay on the forces that act now. Internal forces are in equilibrium with C, the
  /// loads and the inertia between a point and the tip: at the tip M = 0 and Q = C + the tip load, and the clamp's
  /// reaction, −Q and −M at x = 0, balances them and the rate of momentum.
  struct Response {
    double tip_acceleration = 0.0;
    InternalForces forces;
  };
  Response response() const;
  /// How it changes, with C and the loads at these rates.
  Response response_rate(const Loads::Values& loads_rate, double tip_force_rate) const;

  /// Put the beam at rest under the tip force and the loads that act now.
  void put_at_rest();

  /// Mean velocity of the tip over two steps of `size` [s] without a tip force, under the loads that act now:
  /// w = [u(t + 2·size) − u(t)]/(2·size) [m/s]. By two trial steps, which leave no trace.
  double forecast(double size);
  /// Its rate under what acts now, with the loads at these rates [m/s²]: linear in the state and the loads, it is the
  /// forecast from the rates of both.
  double forecast_rate(double size, const Loads::Values& loads_rate);

  /// What 1 N held over a step of `size` [s] adds to u(L) at that step's end, and at the end of another step without a
  /// force [m/N]. As the beam is linear, forces C₁, C₂ over the next two steps lead to
  ///     u(t + 2·size) = u(t) + 2·size·w + C₁ r[1] + C₂ r[0].
  /// @throws as step()
  using TipResponse = std::array<double, 2>;
  TipResponse tip_response(double size);

  /// The whole dynamic state.
  struct State {
    Eigen::VectorXd q, v;
    struct Scalars {
      double integral = 0.0, integral_2 = 0.0, dissipated = 0.0, load_work = 0.0;
      double tip_force = 0.0;  ///< C [N] and the loads at the end of the last step, or as set since
      Loads::Values loads{};
    } scalars;
  };
  const State& state() const { return book(), now_; }
  /// @pre the state is of a beam with the same parameters
  void restore(const State& state);

 protected:
  Beam(std::unique_ptr<const Discretisation> space, const Parameters& parameters);
  /// Refuse steps in which a mode of this frequency [rad/s] turns so far that rounding leaves nothing of its phase.
  void limit_phase(double fastest);
  /// @throws std::invalid_argument if one of these is so large that outputs could overflow
  static void require_coefficients(std::initializer_list<double> values);

  /// Makes `now_` of `start_`, but for its forces and, if book_step() does it, work.
  virtual void advance(double size, const Polynomial& tip_force, const Loads& loads) = 0;
  /// Add to `now_` the energy that the last step dissipated and the work of its loads. Called when these are read or a
  /// step follows: a step that is tried and taken back, as in event location, does without.
  virtual void book_step() const {}

  Eigen::VectorXd force(Loads::Values loads, double tip_force = 0.0) const;  ///< Σ values·F

  double alpha_b_;          // [s]
  Eigen::VectorXd struck_;  // M⁻¹e, the velocity that a unit impulse leaves
  mutable State now_;       // includes the work of the last step once that is computed
  State start_;             // at the start of the last step

 private:
  class Trial;
  void book() const;
  void move(double size, const Polynomial& tip_force, const Loads& loads);  ///< a step that checks nothing
  Eigen::VectorXd inertia_force() const;  ///< M q̈ under what acts now: all forces that stiffness and damping leave
  Eigen::VectorXd acceleration() const { return space_->mass_solve(inertia_force()); }
  double potential(const Loads::Values& loads, const Eigen::VectorXd& x) const;
  Response respond(const Eigen::VectorXd& acceleration, Loads::Values loads, double tip_force) const;

  double longest_step_;  // [s]
  std::unique_ptr<const Discretisation> space_;
  Eigen::Matrix<double, shape_points, Loads::count> shear_, moment_;  // internal forces of each load
  mutable bool booked_ = true;                                        // whether `now_` has the work of the last step
};

/// @pre each parameter is within its own limits, those of the table in fmus/beam/beam_fmu.cpp
/// @throws std::invalid_argument naming the parameter, its value and what is allowed beside the others
/// @throws std::runtime_error if the eigensolver does not converge
std::unique_ptr<Beam> make_beam(const Parameters& parameters);

}  // namespace beam
