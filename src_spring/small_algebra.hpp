// SUNDIALS' serial vector and dense linear solver with our own kernels for what IDA does in every step. Distributions
// ship SUNDIALS archives built without optimisation; for a handful of unknowns this is then most of the run time.
// The kernels also make the arithmetic the same whatever SUNDIALS was built with.
#pragma once

#include "sundials_compat.hpp"

namespace spring {

/// @return nullptr if memory is short; clones share the kernels. Free with N_VDestroy.
N_Vector new_small_vector(int length, SUNContext context);

/// LU with partial pivoting of the dense matrix J. @return nullptr if memory is short. Free with SUNLinSolFree.
SUNLinearSolver new_small_linear_solver(N_Vector vector, SUNMatrix J, SUNContext context);

}  // namespace spring
