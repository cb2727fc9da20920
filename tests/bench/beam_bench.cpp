// The beam beside what its step cannot do without: one banded solve and one banded product of the mesh's unknowns, or
// as many 2×2 products as there are modes. beam_bench [--quick]
#include <malloc.h>

#include <cmath>
#include <fstream>
#include <stdexcept>
#include <string>

#include "../../src_beam/beam.hpp"
#include "../../src_beam/timoshenko.hpp"
#include "paired.hpp"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

namespace {

using Eigen::VectorXd;

/// The beam of paper-fig2.
beam::Parameters paper(int n_elements, int n_modes) {
  beam::Parameters p;
  p.young_modulus = p.shear_modulus = 3.6e10;
  p.n_elements = n_elements;
  p.n_modes = n_modes;
  p.integrator = n_modes == 0 ? beam::Integrator::midpoint : beam::Integrator::modal;
  p.initial_velocity_slope = -1.0;
  return p;
}

constexpr double h = 0.004;

/// What a step of (62) needs at the least.
class Bare {
 public:
  explicit Bare(const beam::Parameters& p) : mesh_(p), K_(assembled(0.0, 1.0)), b_(mesh_.linear_shape()) {
    const Eigen::SparseMatrix<double> S = assembled(1.0, 0.25 * h * h);
    factor_.compute(S);
    if (factor_.info() != Eigen::Success) throw std::runtime_error("not factorised");
  }
  void solve_and_multiply() {
    x_ = factor_.solve(b_);
    y_.noalias() = K_.selfadjointView<Eigen::Lower>() * x_;
    bench::keep(y_[0]);
  }

 private:
  /// Its lower triangle, in the pattern of both matrices.
  Eigen::SparseMatrix<double> assembled(double m, double k) const {
    const Eigen::MatrixXd element = mesh_.element(m, k);
    Eigen::SparseMatrix<double> matrix(mesh_.size(), mesh_.size());
    for (Eigen::Index first = -2; first + 2 < mesh_.size(); first += element.rows() - 2) {
      for (Eigen::Index i = 0; i < element.rows(); ++i) {
        for (Eigen::Index j = std::max<Eigen::Index>(0, -first); j <= i; ++j)
          matrix.coeffRef(first + i, first + j) += element(i, j);
      }
    }
    return matrix;
  }

  beam::Timoshenko mesh_;
  Eigen::SparseMatrix<double> K_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::NaturalOrdering<int>> factor_;
  VectorXd b_, x_, y_;
};

/// η⁺ = A η + B v + b C, v⁺ likewise, and the tip's displacement: exact modes and nothing else.
class BareModes {
 public:
  explicit BareModes(Eigen::Index m) : a_(7, m), eta_(m), v_(m), next_(m) {
    for (Eigen::Index i = 0; i < m; ++i) {
      const double x = 0.3 * static_cast<double>(i + 1);
      a_.col(i) << std::cos(x), std::sin(x), -std::sin(x), std::cos(x), 1e-3, 1e-3, 1.0;
    }
    eta_.setZero();
    v_.setOnes();
    rows_ = a_.transpose();
  }
  void step(double force) {
    next_ = rows_.col(0) * eta_ + rows_.col(1) * v_ + rows_.col(4) * force;
    v_ = rows_.col(2) * eta_ + rows_.col(3) * v_ + rows_.col(5) * force;
    eta_.swap(next_);
    bench::keep((rows_.col(6) * eta_).sum());
  }

 private:
  Eigen::ArrayXXd a_, rows_;
  Eigen::ArrayXd eta_, v_, next_;
};

/// A line of /proc/self/status [bytes].
double status(const std::string& key) {
  std::ifstream file("/proc/self/status");
  for (std::string word; file >> word;) {
    if (word != key) continue;
    double kilobytes = 0.0;
    file >> kilobytes;
    return 1024.0 * kilobytes;
  }
  throw std::runtime_error("no " + key + " in /proc/self/status");
}

/// Memory in use now; from here on the largest is VmHWM.
double begin_peak() {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";
  return status("VmRSS:");
}

/// Time per step and memory at its most against the number of elements.
void scaling(const bench::Options& o) {
  for (const int modes : {0, 64}) {
    std::vector<double> elements, step, memory;
    for (int n = 100; n <= (o.quick ? 1000 : 100000); n *= 10) {
      const double before = begin_peak();
      const auto one = beam::make_beam(paper(n, modes));
      const auto work = [&one] { one->step(h, {1.0, 0.0, 0.0}, 0.0); };
      const std::size_t calls = bench::calls_for(work, o.seconds);
      memory.push_back(status("VmHWM:") - before);
      std::vector<double> times;
      for (int round = 0; round < o.rounds; ++round) times.push_back(bench::timed(work, calls));
      std::sort(times.begin(), times.end());
      elements.push_back(n);
      step.push_back(times[times.size() / 2]);
    }
    std::printf("{\"name\": \"scaling\", \"modes\": %d, ", modes);
    bench::print("elements", elements);
    std::printf(", ");
    bench::print("step", step);
    std::printf(", ");
    bench::print("memory", memory);
    std::printf("}\n");
  }
}

}  // namespace

int main(int argc, char** argv) {
  const bench::Options o = bench::options(argc, argv);
  {
    const auto direct = beam::make_beam(paper(1000, 0));
    Bare bare(paper(1000, 0));
    double force = 1.0;
    bench::compare(
        "midpoint", o, [&] { direct->step(h, {force += 1e-3, 0.0, 0.0}, 0.0); }, [&] { bare.solve_and_multiply(); });
    const beam::Beam::State state = direct->state();
    bench::compare(
        "midpoint repeated", o,
        [&] {
          direct->restore(state);
          direct->step(h, {force += 1e-3, 0.0, 0.0}, 0.0);
        },
        [&] { bare.solve_and_multiply(); });
  }
  {
    const beam::Parameters p = paper(1000, 64);
    const bench::Values values{{"young_modulus", p.young_modulus},
                               {"shear_modulus", p.shear_modulus},
                               {"n_elements", p.n_elements},
                               {"n_modes", p.n_modes},
                               {"initial_velocity_slope", p.initial_velocity_slope}};
    bench::Fmu fmu(values);
    BareModes bare(64);
    const double force = 1.0;
    bench::compare("modal fmu", o, [&] { fmu.step(h); }, [&] { bare.step(force); });
    bench::compare("modal fmu repeated", o, [&] { fmu.repeat(h); }, [&] { bare.step(force); });
  }
  scaling(o);
  return 0;
}
