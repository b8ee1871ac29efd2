// What the machine can do at best: bytes a second by footprint, multiply-adds a second.
#pragma once

#include <vector>

namespace vdbfrac::lab::bench {

struct Bandwidth {
    int threads = 1;
    double footprint = 0;  ///< bytes touched by all threads together
    double read = 0;       ///< bytes/s
    double triad = 0;      ///< bytes/s: two arrays read, one written
};

struct Arithmetic {
    int threads = 1;
    double flops = 0;  ///< double multiplications and additions a second
};

/// Bytes that have to be moved.
struct Traffic {
    double read = 0, written = 0;
    double bytes() const { return read + written; }
};

struct Floors {
    std::vector<Bandwidth> memory;
    std::vector<Arithmetic> arithmetic;

    /// Seconds in which `threads` move the bytes once: each byte written goes with two read as in a triad, the rest is
    /// only read. The bandwidth is that of a footprint of all bytes: between measured ones by the logarithm of the
    /// footprint, beyond them that of the nearest. `threads` has to be one that was measured.
    double seconds(int threads, const Traffic& traffic) const;

private:
    double bandwidth(int threads, double footprint, double Bandwidth::*of) const;
};

/// Measures for one thread and for `threads`; some four seconds.
Floors measureFloors(int threads);

/// "AVX-512", "AVX2" or "baseline": the widest vector unit that the kernels may use on this machine.
const char* vectorUnit();

}  // namespace vdbfrac::lab::bench
