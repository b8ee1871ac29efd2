// While it lives, results too small for a normal number become 0 on this thread: far from a load the vectors of an
// iteration in single precision decay into denormals, which cost a processor some twenty times as much. Not installed.
#pragma once

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace vdbfrac::solver {

class FlushDenormals {
public:
#if defined(__SSE__)
    FlushDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | 0x8040); }  // flush results, take operands as 0
    ~FlushDenormals() { _mm_setcsr(saved_); }

private:
    unsigned saved_;
#else
    FlushDenormals() = default;
#endif
    FlushDenormals(const FlushDenormals&) = delete;
    FlushDenormals& operator=(const FlushDenormals&) = delete;
};

}  // namespace vdbfrac::solver
