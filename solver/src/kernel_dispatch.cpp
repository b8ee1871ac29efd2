#include "kernel.h"

namespace vdbfrac::solver {

namespace kernelBaseline {
extern const Kernel kernel;
}
#if defined(__x86_64__)
namespace kernelAvx2 {
extern const Kernel kernel;
}
namespace kernelAvx512 {
extern const Kernel kernel;
}
#endif

const Kernel* const* kernels(int& count)
{
#if defined(__x86_64__)
    static const Kernel* const kAll[] = {&kernelBaseline::kernel, &kernelAvx2::kernel, &kernelAvx512::kernel};
#else
    static const Kernel* const kAll[] = {&kernelBaseline::kernel};
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
