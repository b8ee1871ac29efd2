// The parts of a kernel: a file each, compiled once for each vector unit in a namespace with the name of the unit. All
// else in those files is without linkage, so no code for a wide unit leaks into the rest of the program.
#pragma once

#include "kernel.h"

namespace vdbfrac::solver::VDBFRAC_KERNEL {

KernelResult evaluate(const PatchData&, const RobustTet&, const double* in, double* out);
double product(const PatchData&, const double* in, double* out);
double product(const PatchData&, const float* in, float* out);
void diagonal(const PatchData&, double* out);
void averageTets(const PatchData&, const RobustTet&, TetTangent* cells);
void polar(const RobustTet&, LanePolars&);

}  // namespace vdbfrac::solver::VDBFRAC_KERNEL
