// How much memory there is.
#pragma once

#include <cstdint>

namespace vdbfrac::lab {

inline constexpr double kGiB = 1024. * 1024 * 1024;

/// 80 % of the memory that is available now [bytes].
std::uint64_t defaultMemoryLimit();
/// Most memory this process has used so far [bytes].
std::uint64_t peakMemory();
/// Lets peakMemory() count from here on, after giving back what is free; returns the memory [bytes] in use now. Where
/// the system does not allow it, peakMemory() stays that of the whole process.
std::uint64_t resetPeakMemory();

}  // namespace vdbfrac::lab
