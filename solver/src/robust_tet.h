// The scalar path of the kernels, by singular values; symmetric matrices as they pack them. Not installed.
#pragma once

#include "kernel.h"

#include <vdbfrac/base/vec.h>

namespace vdbfrac::solver {

inline constexpr int kRow[6] = {0, 1, 2, 1, 2, 0}, kColumn[6] = {0, 1, 2, 2, 0, 1};

inline void packSymmetric(const Mat3& m, double* packed)
{
    for (int k = 0; k < 6; ++k) packed[k] = m(kRow[k], kColumn[k]);
}

inline Mat3 unpackSymmetric(const double* packed)
{
    Mat3 m;
    for (int k = 0; k < 6; ++k) m(kRow[k], kColumn[k]) = m(kColumn[k], kRow[k]) = packed[k];
    return m;
}

extern const RobustTet kRobust;

}  // namespace vdbfrac::solver
