#include "small_algebra.hpp"

#include <cmath>
#include <utility>

namespace spring {
namespace {

double* data(N_Vector v) { return NV_DATA_S(v); }
sunindextype length(N_Vector v) { return NV_LENGTH_S(v); }

/// z = a x + b y
void linear_sum(sunrealtype a, N_Vector x, sunrealtype b, N_Vector y, N_Vector z) {
  const double *X = data(x), *Y = data(y);
  double* Z = data(z);
  for (sunindextype i = 0, n = length(z); i < n; ++i) Z[i] = a * X[i] + b * Y[i];
}

void set_constant(sunrealtype c, N_Vector z) {
  double* Z = data(z);
  for (sunindextype i = 0, n = length(z); i < n; ++i) Z[i] = c;
}

/// z = c x
void scale(sunrealtype c, N_Vector x, N_Vector z) {
  const double* X = data(x);
  double* Z = data(z);
  for (sunindextype i = 0, n = length(z); i < n; ++i) Z[i] = c * X[i];
}

void absolute(N_Vector x, N_Vector z) {
  const double* X = data(x);
  double* Z = data(z);
  for (sunindextype i = 0, n = length(z); i < n; ++i) Z[i] = std::abs(X[i]);
}

void inverse(N_Vector x, N_Vector z) {
  const double* X = data(x);
  double* Z = data(z);
  for (sunindextype i = 0, n = length(z); i < n; ++i) Z[i] = 1.0 / X[i];
}

void add_constant(N_Vector x, sunrealtype b, N_Vector z) {
  const double* X = data(x);
  double* Z = data(z);
  for (sunindextype i = 0, n = length(z); i < n; ++i) Z[i] = X[i] + b;
}

/// √(Σ (xᵢ wᵢ)² / n)
sunrealtype wrms_norm(N_Vector x, N_Vector w) {
  const double *X = data(x), *W = data(w);
  const sunindextype n = length(x);
  double sum = 0.0;
  for (sunindextype i = 0; i < n; ++i) sum += X[i] * W[i] * (X[i] * W[i]);
  return std::sqrt(sum / static_cast<double>(n));
}

/// z = Σ cₖ xₖ; z may be x₀.
int linear_combination(int terms, sunrealtype* c, N_Vector* x, N_Vector z) {
  double* Z = data(z);
  for (sunindextype i = 0, n = length(z); i < n; ++i) {
    double sum = 0.0;
    for (int k = 0; k < terms; ++k) sum += c[k] * data(x[k])[i];
    Z[i] = sum;
  }
  return 0;
}

/// zₖ = a xₖ + b yₖ
int linear_sum_arrays(int vectors, sunrealtype a, N_Vector* x, sunrealtype b, N_Vector* y, N_Vector* z) {
  for (int k = 0; k < vectors; ++k) linear_sum(a, x[k], b, y[k], z[k]);
  return 0;
}

/// zₖ = cₖ xₖ
int scale_arrays(int vectors, sunrealtype* c, N_Vector* x, N_Vector* z) {
  for (int k = 0; k < vectors; ++k) scale(c[k], x[k], z[k]);
  return 0;
}

SUNLinearSolverContent_Dense content(SUNLinearSolver solver) {
  return static_cast<SUNLinearSolverContent_Dense>(solver->content);
}

/// A = P⁻¹ L U in place, column-major, as LAPACK's getrf.
int factorise(SUNLinearSolver solver, SUNMatrix matrix) {
  double* A = SM_DATA_D(matrix);
  const sunindextype n = SM_ROWS_D(matrix);
  sunindextype* pivots = content(solver)->pivots;
  for (sunindextype k = 0; k < n; ++k) {
    double* column = A + k * n;
    sunindextype pivot = k;
    for (sunindextype i = k + 1; i < n; ++i)
      if (std::abs(column[i]) > std::abs(column[pivot])) pivot = i;
    pivots[k] = pivot;
    if (column[pivot] == 0.0) {
      content(solver)->last_flag = k + 1;
      return 1;  // recoverable: another step size may give a regular matrix
    }
    if (pivot != k)
      for (sunindextype j = 0; j < n; ++j) std::swap(A[j * n + k], A[j * n + pivot]);
    for (sunindextype i = k + 1; i < n; ++i) column[i] /= column[k];
    for (sunindextype j = k + 1; j < n; ++j) {
      const double factor = A[j * n + k];
      if (factor == 0.0) continue;
      for (sunindextype i = k + 1; i < n; ++i) A[j * n + i] -= factor * column[i];
    }
  }
  content(solver)->last_flag = 0;
  return 0;
}

int solve(SUNLinearSolver solver, SUNMatrix matrix, N_Vector x, N_Vector b, sunrealtype) {
  const double* A = SM_DATA_D(matrix);
  const sunindextype n = SM_ROWS_D(matrix);
  const sunindextype* pivots = content(solver)->pivots;
  double* X = data(x);
  if (x != b) scale(1.0, b, x);
  for (sunindextype k = 0; k < n; ++k)
    if (pivots[k] != k) std::swap(X[k], X[pivots[k]]);
  for (sunindextype k = 0; k < n; ++k)
    for (sunindextype i = k + 1; i < n; ++i) X[i] -= X[k] * A[k * n + i];
  for (sunindextype k = n; k-- > 0;) {
    X[k] /= A[k * n + k];
    for (sunindextype i = 0; i < k; ++i) X[i] -= X[k] * A[k * n + i];
  }
  content(solver)->last_flag = 0;
  return 0;
}

}  // namespace

N_Vector new_small_vector(int length, SUNContext context) {
  N_Vector vector = N_VNew_Serial(length, context);
  if (vector == nullptr) return nullptr;
  N_Vector_Ops ops = vector->ops;
  ops->nvlinearsum = linear_sum;
  ops->nvconst = set_constant;
  ops->nvscale = scale;
  ops->nvabs = absolute;
  ops->nvinv = inverse;
  ops->nvaddconst = add_constant;
  ops->nvwrmsnorm = wrms_norm;
  ops->nvlinearcombination = linear_combination;
  ops->nvlinearsumvectorarray = linear_sum_arrays;
  ops->nvscalevectorarray = scale_arrays;
  return vector;
}

SUNLinearSolver new_small_linear_solver(N_Vector vector, SUNMatrix J, SUNContext context) {
  SUNLinearSolver solver = SUNLinSol_Dense(vector, J, context);
  if (solver == nullptr) return nullptr;
  solver->ops->setup = factorise;
  solver->ops->solve = solve;
  return solver;
}

}  // namespace spring
