// A libFuzzer target: one for each kind, by VDBFRAC_FUZZ_KIND.
#include "inputs.h"

#include <cstddef>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    static const vdbfrac::fuzz::Kind& kind = vdbfrac::fuzz::kindOf(VDBFRAC_FUZZ_KIND);
    kind.run({reinterpret_cast<const char*>(data), size});
    return 0;
}
