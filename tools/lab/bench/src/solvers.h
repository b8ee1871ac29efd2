// The parts of the workload `solvers`.
#pragma once

#include <vdbfrac/lab/bench/bench.h>
#include <vdbfrac/solver/linear_solver.h>

namespace vdbfrac::lab::bench {

const char* nameOf(solver::LinearMethod method);

/// Adds "scaling" and "exponents"; `sizes`: nodes a side.
void benchScaling(const std::vector<int>& sizes, const Say& say, Json& result);
/// Adds "time_to_residual".
void benchResiduals(const std::vector<int>& sizes, const Say& say, Json& result);

}  // namespace vdbfrac::lab::bench
