#include "kernel.h"

#include <vdbfrac/base/error.h>

#include <string_view>
#include <vector>

// CMakeLists.txt lists the units that kernels were compiled for, narrowest first.
#define VDBFRAC_UNIT(name)            \
    namespace vdbfrac::solver::name { \
    extern const Kernel kernel;       \
    }
VDBFRAC_UNITS
#undef VDBFRAC_UNIT

namespace vdbfrac::solver {

namespace {

bool runsHere(std::string_view unit)
{
#if defined(__x86_64__)
    const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    if (unit == "kernelAvx2") return avx2;
    if (unit == "kernelAvx512")
        return avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
               __builtin_cpu_supports("avx512vl");
#endif
    return unit == "kernelBaseline";
}

std::vector<const Kernel*> findKernels()
{
    std::vector<const Kernel*> found;
#define VDBFRAC_UNIT(name) \
    if (runsHere(#name)) found.push_back(&name::kernel);
    VDBFRAC_UNITS
#undef VDBFRAC_UNIT
    return found;
}

}  // namespace

std::span<const Kernel* const> kernels()
{
    static const std::vector<const Kernel*> kFound = findKernels();
    return kFound;
}

const Kernel& kernel()
{
    if (kernels().empty())
        throw LimitError(
            "this program was built for the vector unit of another processor; build it with -DVDBFRAC_KERNELS=all");
    return *kernels().back();
}

}  // namespace vdbfrac::solver
