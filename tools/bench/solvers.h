// The parts of the workload `solvers`.
#pragma once

#include "bench.h"

#include <vdbfrac/solver/linear_solver.h>

namespace vdbfrac::tools::bench {

const char* nameOf(solver::LinearMethod method);

/// Adds "scaling" and "exponents"; `sizes`: nodes a side.
void benchScaling(const std::vector<int>& sizes, const Say& say, Json& result);
/// Adds "time_to_residual".
void benchResiduals(const std::vector<int>& sizes, const Say& say, Json& result);

}  // namespace vdbfrac::tools::bench
