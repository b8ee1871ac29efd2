// Memory that a process may take, as /proc and control groups tell it: on the system, in a job of Slurm, in a
// container.
#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/lab/machine/memory.h>

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

namespace fs = std::filesystem;

namespace {

constexpr std::uint64_t kMiB = 1 << 20;

/// The part of a file system that tells it.
class AvailableMemory : public testing::Test {
protected:
    AvailableMemory()
    {
        fs::remove_all(root_);
        put("proc/meminfo", "MemTotal: 16777216 kB\nMemFree: 1 kB\nMemAvailable: 8388608 kB\n");
    }
    ~AvailableMemory() override { fs::remove_all(root_); }

    void put(const std::string& file, const std::string& text) const
    {
        fs::create_directories((root_ / file).parent_path());
        vdbfrac::writeText(root_ / file, text);
    }
    void group2(const std::string& folder, const std::string& limit, std::uint64_t used, std::uint64_t cache) const
    {
        put("sys/fs/cgroup/" + folder + "/memory.max", limit + "\n");
        put("sys/fs/cgroup/" + folder + "/memory.current", std::to_string(used * kMiB) + "\n");
        put("sys/fs/cgroup/" + folder + "/memory.stat", "anon 1\ninactive_file " + std::to_string(cache * kMiB) + "\n");
    }
    std::uint64_t mebibytes() const { return vdbfrac::lab::availableMemory(root_) / kMiB; }

    fs::path root_ = fs::temp_directory_path() / ("vdbfrac_memory_" + std::to_string(::getpid()));
};

TEST_F(AvailableMemory, IsThatOfTheSystemWithoutAGroup)
{
    EXPECT_EQ(mebibytes(), 8192u);
    put("proc/self/cgroup", "0::/user\n");
    group2("user", "max", 100, 0);
    EXPECT_EQ(mebibytes(), 8192u);
}

TEST_F(AvailableMemory, IsWhatTheTightestGroupLeaves)
{
    put("proc/self/cgroup", "0::/slurm/job_7/step_0\n");
    group2("slurm/job_7/step_0", "max", 90, 0);
    group2("slurm/job_7", std::to_string(500 * kMiB), 200, 50);  // 50 of it would be given back
    group2("slurm", std::to_string(4000 * kMiB), 1000, 0);
    EXPECT_EQ(mebibytes(), 350u);
    group2("slurm/job_7", std::to_string(500 * kMiB), 600, 0);
    EXPECT_EQ(mebibytes(), 0u);
}

TEST_F(AvailableMemory, OfAContainerIsInItsOwnRoot)
{
    put("proc/self/cgroup", "0::/docker/0123\n");  // as the host names it
    put("sys/fs/cgroup/memory.max", std::to_string(300 * kMiB) + "\n");
    put("sys/fs/cgroup/memory.current", std::to_string(100 * kMiB) + "\n");
    EXPECT_EQ(mebibytes(), 200u);
}

TEST_F(AvailableMemory, KnowsTheFirstVersionOfGroups)
{
    put("proc/self/cgroup", "5:cpu,cpuacct:/a\n4:memory:/a/b\n0::/\n");
    put("sys/fs/cgroup/memory/a/memory.limit_in_bytes", std::to_string(400 * kMiB) + "\n");
    put("sys/fs/cgroup/memory/a/memory.usage_in_bytes", std::to_string(150 * kMiB) + "\n");
    put("sys/fs/cgroup/memory/a/memory.stat", "cache 5\ntotal_inactive_file " + std::to_string(30 * kMiB) + "\n");
    put("sys/fs/cgroup/memory/a/b/memory.limit_in_bytes", "9223372036854771712\n");
    EXPECT_EQ(mebibytes(), 280u);
}

}  // namespace
