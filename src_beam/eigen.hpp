// Eigen's dense matrices, with temporary arrays on the heap where they are not small: threads may have 128 KiB of
// stack, of which Eigen takes as much for one array. To be included before any other header of Eigen.
#pragma once

#define EIGEN_STACK_ALLOCATION_LIMIT 8192  // bytes; an element of the highest degree has an array of 4608

#include <Eigen/Core>
