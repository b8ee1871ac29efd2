#include "kernel.h"

namespace vdbfrac::solver {

extern const Kernel kernelBaseline;
#if defined(__x86_64__)
extern const Kernel kernelAvx2, kernelAvx512;
#endif

const Kernel* const* kernels(int& count)
{
#if defined(__x86_64__)
    static const Kernel* const kAll[] = {&kernelBaseline, &kernelAvx2, &kernelAvx512};
#else
    static const Kernel* const kAll[] = {&kernelBaseline};
#endif
    count = 1;
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) count = 2;
    if (count == 2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl"))
        count = 3;
#endif
    return kAll;
}

const Kernel& kernel()
{
    int count = 0;
    const Kernel* const* all = kernels(count);
    return *all[count - 1];
}

}  // namespace vdbfrac::solver
