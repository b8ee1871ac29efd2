// The loops that find a machine's limits: reading memory, streaming through it, multiplying and adding.
//
// They stand in a file of their own that is compiled once for each vector unit, like the element kernel, so that an
// ordinary build shows what the machine can do and not what its oldest relative could. The caller reaches them through
// pointers: no compiler can see that two passes over a buffer give the same, and leave one out.
#pragma once

#include <cstddef>

namespace vdbfrac::lab::bench {

struct FloorKernel {
    /// Sum of `count` values. Reads 8 bytes a value.
    double (*read)(const double* values, std::size_t count);
    /// a = b + s c. Moves 24 bytes a value, not counting that a processor may read `a` before it writes it.
    void (*triad)(double* a, const double* b, const double* c, double s, std::size_t count);
    /// Independent chains of multiply-adds in registers; the result depends on each of them.
    double (*multiplyAdd)(std::size_t rounds);
    double flopsOfRound;  ///< multiplications and additions in a round of multiplyAdd
    const char* name;     ///< of the vector unit
};

/// For the widest vector unit this machine has.
const FloorKernel& floorKernel();

}  // namespace vdbfrac::lab::bench
