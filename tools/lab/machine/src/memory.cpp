#include <vdbfrac/lab/machine/memory.h>

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <limits>
#include <string>

namespace vdbfrac::lab {

std::uint64_t defaultMemoryLimit()
{
    std::ifstream info("/proc/meminfo");
    std::string key, unit;
    std::uint64_t kilobytes = 0;
    while (info >> key >> kilobytes) {
        std::getline(info, unit);
        if (key == "MemAvailable:") return kilobytes * 1024 / 10 * 8;
    }
    return std::numeric_limits<std::uint64_t>::max();
}

std::uint64_t peakMemory()
{
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return std::uint64_t(usage.ru_maxrss) * 1024;
}

std::uint64_t resetPeakMemory()
{
    malloc_trim(0);
    {
        std::ofstream reset("/proc/self/clear_refs");
        reset << "5";  // Linux: the peak becomes what is in use now
    }
    std::ifstream pages("/proc/self/statm");
    std::uint64_t all = 0, resident = 0;
    pages >> all >> resident;
    return resident * std::uint64_t(sysconf(_SC_PAGESIZE));
}

}  // namespace vdbfrac::lab
