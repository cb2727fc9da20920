// The spring's step beside IDA restarted for the same step on (y, z, ∫y, ∫∫y) itself, with the same tolerances.
// spring_bench [--quick]
#include <ida/ida.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include "../../src_spring/spring.hpp"
#include "paired.hpp"

#ifndef SUN_COMM_NULL  // before SUNDIALS 7
#define SUN_COMM_NULL nullptr
#endif

namespace {

/// The spring of the scene "soft", moving down under a force like the one it meets there.
struct Problem {
  double m = 1.0, k1 = 3.0, k2 = -0.2, C = 5.0, y = -0.005, z = -0.4, H = 0.004;
};

/// m ÿ + k1 y + k2 y³ = −C as F(t, Y, Ẏ) = 0 with Y = (y, z, ∫y, ∫∫y), as one would write it down.
class BareIda {
 public:
  BareIda(const Problem& problem, double relative, double absolute) : p_(problem) {
    check(SUNContext_Create(SUN_COMM_NULL, &context_));
    Y_ = N_VNew_Serial(4, context_);
    Yp_ = N_VNew_Serial(4, context_);
    J_ = SUNDenseMatrix(4, 4, context_);
    solver_ = SUNLinSol_Dense(Y_, J_, context_);
    ida_ = IDACreate(context_);
    start();
    check(IDAInit(ida_, residual, 0.0, Y_, Yp_));
    check(IDASStolerances(ida_, relative, absolute));
    check(IDASetUserData(ida_, &p_));
    check(IDASetLinearSolver(ida_, solver_, J_));
    check(IDASetJacFn(ida_, jacobian));
  }
  ~BareIda() {
    IDAFree(&ida_);
    SUNLinSolFree(solver_);
    SUNMatDestroy(J_);
    N_VDestroy(Y_);
    N_VDestroy(Yp_);
    SUNContext_Free(&context_);
  }
  BareIda(const BareIda&) = delete;
  BareIda& operator=(const BareIda&) = delete;

  void step() {
    start();
    check(IDAReInit(ida_, 0.0, Y_, Yp_));
    check(IDASetStopTime(ida_, p_.H));
    double t = 0.0;
    check(IDASolve(ida_, p_.H, &t, Y_, Yp_, IDA_NORMAL));
  }
  double displacement() const { return NV_Ith_S(Y_, 0); }
  long steps() const {
    long n = 0;
    check(IDAGetNumSteps(ida_, &n));
    return n;
  }

 private:
  static void check(int flag) {
    if (flag < 0) throw std::runtime_error("IDA failed");
  }
  void start() {
    double* Y = N_VGetArrayPointer(Y_);
    double* Yp = N_VGetArrayPointer(Yp_);
    Y[0] = p_.y, Y[1] = p_.z, Y[2] = Y[3] = 0.0;
    Yp[0] = p_.z, Yp[1] = acceleration(p_, p_.y), Yp[2] = p_.y, Yp[3] = 0.0;
  }
  static double acceleration(const Problem& p, double y) { return (-p.C - p.k1 * y - p.k2 * y * y * y) / p.m; }
  static int residual(sunrealtype, N_Vector Y, N_Vector Yp, N_Vector F, void* data) {
    const auto& p = *static_cast<const Problem*>(data);
    const double *y = N_VGetArrayPointer(Y), *d = N_VGetArrayPointer(Yp);
    double* f = N_VGetArrayPointer(F);
    f[0] = d[0] - y[1];
    f[1] = d[1] - acceleration(p, y[0]);
    f[2] = d[2] - y[0];
    f[3] = d[3] - y[2];
    return 0;
  }
  static int jacobian(sunrealtype, sunrealtype c, N_Vector Y, N_Vector, N_Vector, SUNMatrix J, void* data, N_Vector,
                      N_Vector, N_Vector) {
    const auto& p = *static_cast<const Problem*>(data);
    const double y = NV_Ith_S(Y, 0);
    for (int i = 0; i < 4; ++i) SM_ELEMENT_D(J, i, i) = c;
    SM_ELEMENT_D(J, 0, 1) = -1.0;
    SM_ELEMENT_D(J, 1, 0) = (p.k1 + 3.0 * p.k2 * y * y) / p.m;
    SM_ELEMENT_D(J, 2, 0) = -1.0;
    SM_ELEMENT_D(J, 3, 2) = -1.0;
    return 0;
  }

  Problem p_;
  SUNContext context_ = nullptr;
  N_Vector Y_ = nullptr, Yp_ = nullptr;
  SUNMatrix J_ = nullptr;
  SUNLinearSolver solver_ = nullptr;
  void* ida_ = nullptr;
};

/// y after the step by 2000 classical Runge–Kutta steps in extended precision.
double exact(const Problem& p) {
  long double y = p.y, z = p.z;
  const auto a = [&](long double w) { return (-p.C - p.k1 * w - p.k2 * w * w * w) / p.m; };
  constexpr int n = 2000;
  const long double s = static_cast<long double>(p.H) / n;
  for (int i = 0; i < n; ++i) {
    const long double y1 = z, z1 = a(y), y2 = z + s / 2 * z1, z2 = a(y + s / 2 * y1), y3 = z + s / 2 * z2,
                      z3 = a(y + s / 2 * y2), y4 = z + s * z3, z4 = a(y + s * y3);
    y += s / 6 * (y1 + 2 * y2 + 2 * y3 + y4);
    z += s / 6 * (z1 + 2 * z2 + 2 * z3 + z4);
  }
  return static_cast<double>(y);
}

void compare(const char* name, const Problem& p, double relative, const bench::Options& o) {
  spring::Parameters parameters;
  parameters.mass = p.m;
  parameters.linear_stiffness = p.k1;
  parameters.cubic_stiffness = p.k2;
  parameters.displacement = p.y;
  parameters.velocity = p.z;
  parameters.relative_tolerance = relative;
  parameters.absolute_tolerance = 1e-2 * relative;
  spring::Spring spring(parameters);
  BareIda bare(p, relative, 1e-2 * relative);
  spring::Inputs inputs;
  inputs.contact_force[0] = p.C;
  const spring::Spring::State start = spring.state();
  const auto ours = [&] {
    spring.restore(start);
    spring.step(p.H, inputs);
  };
  bench::compare(name, o, ours, [&] { bare.step(); });
  ours();
  bare.step();
  const double y = exact(p);
  std::printf("{\"name\": \"%s counts\", \"ours\": [%ld], \"rival\": [%ld]}\n", name,
              static_cast<long>(spring.internal_steps()), bare.steps());
  std::printf("{\"name\": \"%s errors\", \"ours\": [%.3g], \"rival\": [%.3g]}\n", name,
              std::abs(spring.displacement() - y), std::abs(bare.displacement() - y));
}

/// The top pressed by 5 N against a tip that yields little, which it follows in contact or close to it.
const bench::Values pressed{
    {"linear_stiffness", 3.0}, {"cubic_stiffness", -0.2}, {"displacement", 0.01}, {"external_force", 5.0}};

/// A step under a force that is held, as tools do it, beside the integration that it cannot do without. Apart from the
/// tip the step alone is made. In touch it takes two integrations, exactly (2.000 of 200,000 steps): the end of the
/// first shows the force to some digits, the second is the step under the force found, so none is made for nothing. To
/// vary the first's series by the force instead takes half as many products as the second, and makes another solution
/// of the same step.
void compare_held(const bench::Options& o) {
  constexpr double H = 1e-3;
  bench::Values inside = pressed, outside = pressed;
  inside.insert(
      inside.end(),
      {{"contact_law", 2.0}, {"compliance_stiffness", 1e4}, {"compliance_exponent", 1.5}, {"tip_response", 1e-9}});
  outside.emplace_back("contact_force", 5.0);
  bench::Fmu plain(outside);
  const unsigned force = bench::Fmu::reference("reaction"), u = bench::Fmu::reference("tip_displacement"),
                 y = bench::Fmu::reference("displacement"), C = bench::Fmu::reference("contact_force");
  for (const bool touching : {true, false}) {
    if (!touching) inside.emplace_back("external_force", 0.0);  // nothing else holds it
    bench::Fmu held(inside);
    bench::compare(
        touching ? "held" : "held apart", o,
        [&] {
          held.set(u, touching ? 0.0 : 1e9);
          held.step(H);
          bench::keep(held.get(force));
        },
        [&] {
          plain.set(C, 5.0);
          plain.step(H);
          bench::keep(plain.get(y));
        });
  }
}

}  // namespace

int main(int argc, char** argv) {
  const bench::Options o = bench::options(argc, argv);
  Problem soft;
  compare("soft 1e-12", soft, 1e-12, o);
  compare("soft 1e-10", soft, 1e-10, o);
  Problem fine = soft;
  fine.H = 2.5e-4;
  compare("soft 1e-12 H=2.5e-4", fine, 1e-12, o);
  Problem stiff = soft;  // of paper-fig4
  stiff.k1 = 150.0;
  stiff.k2 = 67.0;
  compare("fig4 1e-12", stiff, 1e-12, o);

  BareIda bare(soft, 1e-12, 1e-14);
  bench::Fmu fmu({{"linear_stiffness", soft.k1},
                  {"cubic_stiffness", soft.k2},
                  {"displacement", soft.y},
                  {"velocity", soft.z},
                  {"contact_force", soft.C}});
  bench::compare("fmu", o, [&] { fmu.repeat(soft.H); }, [&] { bare.step(); });
  bench::Fmu flight({{"linear_stiffness", soft.k1}, {"cubic_stiffness", soft.k2}, {"velocity", soft.z}});
  bench::compare("flight", o, [&] { flight.step(soft.H); }, [&] { bare.step(); });
  compare_held(o);
  return 0;
}
