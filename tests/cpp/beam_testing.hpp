// What the beam's tests share.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "beam.hpp"
#include "modes.hpp"

namespace beam::testing {

/// p with time counted from `t`.
inline Polynomial shifted(const Polynomial& p, double t) { return {value(p, t), p[1] + t * p[2], p[2]}; }

/// κ = EI = KAG, everything else 1: section 6 of the paper.
inline Parameters unit_beam(int n_elements, double kappa = 1.0) {
  Parameters p;
  p.n_elements = n_elements;
  p.young_modulus = kappa;
  p.shear_modulus = kappa;
  return p;
}

/// No two parameters alike, so that a forgotten factor shows.
inline Parameters general_beam(int n_elements, int element_degree = 1) {
  Parameters p;
  p.density = 3.0;
  p.area = 0.7;
  p.second_moment_of_area = 0.11;
  p.young_modulus = 50.0;
  p.shear_modulus = 21.0;
  p.shear_coefficient = 0.85;
  p.length = 1.3;
  p.n_elements = n_elements;
  p.element_degree = element_degree;
  return p;
}

inline double bending(const Parameters& p) { return p.young_modulus * p.second_moment_of_area; }  ///< EI
inline double shearing(const Parameters& p) {                                                     ///< KAG
  return p.shear_modulus * p.shear_coefficient * p.area;
}

/// m M + k K of the mesh, a product a column.
inline Eigen::MatrixXd assembled(const Timoshenko& mesh, double m, double k) {
  const Eigen::MatrixXd unit = Eigen::MatrixXd::Identity(mesh.size(), mesh.size());
  Eigen::MatrixXd matrix(mesh.size(), mesh.size());
  for (Eigen::Index i = 0; i < mesh.size(); ++i) {
    Eigen::VectorXd column = Eigen::VectorXd::Zero(mesh.size());
    mesh.add_products(m, unit.col(i), k, unit.col(i), column);
    matrix.col(i) = column;
  }
  return matrix;
}

inline Modes modes_of(const Parameters& p) { return compute_modes(Timoshenko(p), p.n_modes); }

/// Of the modal beam, ascending [rad/s].
inline std::vector<double> frequencies(const Parameters& p) {
  const Eigen::VectorXd omega = modes_of(p).omega;
  std::vector<double> ascending(omega.data(), omega.data() + omega.size());
  std::sort(ascending.begin(), ascending.end());
  return ascending;
}

/// u(L) per unit static tip force [m/N], of the modes and of the mesh.
inline double static_tip_compliance(const Parameters& p) {
  const Modes modes = modes_of(p);
  return modes.loads[Loads::tip].cwiseQuotient(modes.omega).squaredNorm();
}
inline double mesh_tip_compliance(const Parameters& p) {
  const Timoshenko mesh(p);
  return mesh.tip(mesh.flexibility_times(mesh.load(Loads::tip)));
}

inline Parameters with_integrator(Parameters p, Integrator integrator) {
  p.integrator = integrator;
  return p;
}

/// Both integrators, degrees 1 and 5, with and without damping and truncation, in motion under a load.
inline std::vector<Parameters> variants() {
  std::vector<Parameters> all;
  for (Parameters p : {general_beam(25), general_beam(3, 5)}) {
    p.initial_velocity_slope = -1.0;
    p.initial_deflection_slope = 0.05;
    for (const double alpha_b : {0.0, 2e-3}) {
      p.alpha_b = alpha_b;
      for (const int n_modes : {0, 4}) {
        p.n_modes = n_modes;
        all.push_back(p);
      }
      all.push_back(with_integrator(p, Integrator::midpoint));
      p.mass_matrix = MassMatrix::averaged;
      all.push_back(p);
      all.push_back(with_integrator(p, Integrator::midpoint));
      p.mass_matrix = MassMatrix::consistent;
    }
  }
  return all;
}

/// Clamped–free, EI = KAG = ρA = ρI = L = 1: zeros of det [[X_MM, X_MQ], [X_QM, X_QQ]] of X = exp(A), A from
/// θ' = M/EI, M' = −Q − ρIω²θ, u' = Q/KAG + θ, Q' = −ρAω²u.
inline const std::vector<double>& clamped_free_frequencies() {
  static const std::vector<double> omega = {1.27396492100357,  1.893962818707578, 4.644109211156441,
                                            4.830446154139584, 7.81367505095888,  7.925418160665796};
  return omega;
}

/// Every load at once, each with f₀, f₁/H and f₂/H² of the order 1 made by `noise`.
template <class Noise>
Loads every_load(double H, Noise& noise) {
  Loads loads;
  for (std::size_t i = 0; i < Loads::count; ++i) {
    const double f0 = noise(), f1 = noise() / H, f2 = noise() / (H * H);
    loads.set(i, {f0, f1, f2});
  }
  return loads;
}

/// The same loads, each made another polynomial.
template <class Change>
Loads changed(const Loads& loads, const Change& change) {
  Loads other;
  loads.for_each([&](std::size_t i, const Polynomial& f) { other.set(i, change(f)); });
  return other;
}

inline double mechanical_energy(const Beam& b) { return b.kinetic_energy() + b.strain_energy(); }

/// Everything that can be read, for comparisons bit by bit.
inline std::vector<double> outputs(const Beam& b) {
  std::vector<double> all = {b.tip_displacement(),
                             b.tip_velocity(),
                             b.tip_acceleration(),
                             b.tip_rotation(),
                             b.tip_displacement_integral(),
                             b.tip_displacement_integral_2(),
                             b.kinetic_energy(),
                             b.strain_energy(),
                             b.dissipated_energy(),
                             b.load_work(),
                             b.load_potential()};
  for (const Shape& shape : {b.deflection(), b.rotation()}) all.insert(all.end(), shape.begin(), shape.end());
  return all;
}

/// Pseudo-random numbers in (−1, 1), always the same.
class Noise {
 public:
  double operator()() {
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(static_cast<long long>(state_ >> 11)) * 0x1p-52 - 1.0;
  }

 private:
  unsigned long long state_ = 20240229ULL;
};

}  // namespace beam::testing
