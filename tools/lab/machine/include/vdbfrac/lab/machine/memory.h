// How much memory there is.
#pragma once

#include <cstdint>
#include <filesystem>

namespace vdbfrac::lab {

inline constexpr double kGiB = 1024. * 1024 * 1024;

/// Memory that the process may still take [bytes]: what the system has available, and what the control groups leave
/// that it is in (of Slurm, of containers). `root`: of the file system that tells it.
std::uint64_t availableMemory(const std::filesystem::path& root = "/");
/// 80 % of the memory that is available now [bytes].
std::uint64_t defaultMemoryLimit();
/// Most memory this process has used so far [bytes].
std::uint64_t peakMemory();
/// Lets peakMemory() count from here on, after giving back what is free; returns the memory [bytes] in use now. Where
/// the system does not allow it, peakMemory() stays that of the whole process.
std::uint64_t resetPeakMemory();

}  // namespace vdbfrac::lab
