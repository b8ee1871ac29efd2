// How much memory there is.
#pragma once

#include <cstdint>

namespace vdbfrac::tools {

inline constexpr double kGiB = 1024. * 1024 * 1024;

/// 80 % of the memory that is available now [bytes].
std::uint64_t defaultMemoryLimit();
/// Most memory this process has used so far [bytes].
std::uint64_t peakMemory();

}  // namespace vdbfrac::tools
