#include <vdbfrac/lab/machine/memory.h>

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <optional>
#include <string>

namespace vdbfrac::lab {

namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

/// The number behind a word in a file of words and numbers.
std::optional<std::uint64_t> numberBehind(const fs::path& file, const std::string& word)
{
    std::ifstream in(file);
    std::string key, rest;
    for (std::uint64_t value = 0; in >> key >> value; std::getline(in, rest))
        if (key == word) return value;
    return {};
}

/// A number alone in a file; none in "max", or where there is no such file.
std::optional<std::uint64_t> numberIn(const fs::path& file)
{
    std::ifstream in(file);
    std::uint64_t value = 0;
    return in >> value ? std::optional(value) : std::nullopt;
}

/// Files of a control group that say how much memory it may use, how much it does, and which of that would be given
/// back.
struct GroupFiles {
    const char *limit, *usage, *cache;
};
constexpr GroupFiles kVersion1 = {"memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"};
constexpr GroupFiles kVersion2 = {"memory.max", "memory.current", "inactive_file"};

/// What a group and those that it is in leave; `mount`: where their folders begin. A container may see its own group
/// there under another name than the system gives it.
std::uint64_t leftInGroups(const fs::path& mount, const std::string& group, const GroupFiles& files)
{
    std::uint64_t left = kUnlimited;
    fs::path path = fs::path(group).relative_path();
    while (true) {
        const fs::path folder = mount / path;
        if (const auto limit = numberIn(folder / files.limit)) {
            const std::uint64_t usage = numberIn(folder / files.usage).value_or(0),
                                cache = numberBehind(folder / "memory.stat", files.cache).value_or(0),
                                used = usage - std::min(usage, cache);
            left = std::min(left, *limit - std::min(*limit, used));
        }
        if (path.empty()) return left;
        path = path.parent_path();
    }
}

}  // namespace

std::uint64_t availableMemory(const fs::path& root)
{
    constexpr std::uint64_t kKiB = 1024;
    const auto available = numberBehind(root / "proc/meminfo", "MemAvailable:");
    std::uint64_t left = available ? *available * kKiB : kUnlimited;
    std::ifstream groups(root / "proc/self/cgroup");  // lines as "4:cpu,memory:/a/b", of version 2 "0::/a/b"
    for (std::string line; std::getline(groups, line);) {
        const std::size_t first = line.find(':'), second = line.find(':', first + 1);
        if (second == std::string::npos) continue;
        const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",",
                          group = line.substr(second + 1);
        const fs::path mount = root / "sys/fs/cgroup";
        if (controllers == ",,")
            left = std::min(left, leftInGroups(mount, group, kVersion2));
        else if (controllers.find(",memory,") != std::string::npos)
            left = std::min(left, leftInGroups(mount / "memory", group, kVersion1));
    }
    return left;
}

std::uint64_t defaultMemoryLimit()
{
    const std::uint64_t available = availableMemory();
    return available == kUnlimited ? available : available / 10 * 8;
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
