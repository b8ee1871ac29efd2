// The machine, and what it can do at best, as JSON.
#include <vdbfrac/core/version.h>
#include <vdbfrac/lab/bench/bench.h>

#include <sys/utsname.h>

#include <cstdint>
#include <fstream>
#include <thread>

namespace vdbfrac::lab::bench {

namespace {

/// What stands behind the first line of a file that starts with `key`, without separators and quotes; empty when there
/// is none.
std::string valueOf(const char* file, const std::string& key)
{
    std::ifstream lines(file);
    for (std::string line; std::getline(lines, line);) {
        if (!line.starts_with(key)) continue;
        const std::size_t begin = line.find_first_not_of(" \t:=\"", key.size()), end = line.find_last_not_of(" \"");
        return begin == std::string::npos ? "" : line.substr(begin, end + 1 - begin);
    }
    return "";
}

std::string processor()
{
    if (const std::string name = valueOf("/proc/cpuinfo", "model name"); !name.empty()) return name;
    utsname names{};
    return uname(&names) == 0 ? names.machine : "unknown";
}

std::uint64_t totalMemory()
{
    const std::string kilobytes = valueOf("/proc/meminfo", "MemTotal");
    return kilobytes.empty() ? 0 : std::stoull(kilobytes) * 1024;
}

const char* compiler()
{
#if defined(__clang__)
    return "clang " __clang_version__;
#else
    return "g++ " __VERSION__;
#endif
}

}  // namespace

Json describeMachine(int threads)
{
    return {{"processor", processor()},
            {"cores", std::thread::hardware_concurrency()},
            {"threads", threads},
            {"vector_unit", vectorUnit()},
            {"memory_bytes", totalMemory()},
            {"system", valueOf("/etc/os-release", "PRETTY_NAME")},
            {"compiler", compiler()},
            {"build_type", VDBFRAC_BUILD_TYPE},
            {"flags", VDBFRAC_FLAGS}};
}

Json toJson(const Floors& floors)
{
    Json memory = Json::array(), arithmetic = Json::array();
    for (const Bandwidth& b : floors.memory)
        memory.push_back({{"threads", b.threads},
                          {"footprint_bytes", std::int64_t(b.footprint)},
                          {"read_gb_per_s", b.read * 1e-9},
                          {"triad_gb_per_s", b.triad * 1e-9}});
    for (const Arithmetic& a : floors.arithmetic)
        arithmetic.push_back({{"threads", a.threads}, {"double_gflop_per_s", a.flops * 1e-9}});
    return {{"memory", memory}, {"arithmetic", arithmetic}};
}

}  // namespace vdbfrac::lab::bench
