// The fuzz targets without a fuzzer:
//   fuzz_driver corpus DIR             writes the sound files into DIR/KIND/
//   fuzz_driver replay KIND PATH...    reads files, or all files of folders
//   fuzz_driver mutate COUNT [SEED]    reads COUNT mutations of sound files, in equal shares, and prints how it ended
#include "inputs.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/parallel.h>

#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <new>
#include <random>
#include <stdexcept>

namespace fs = std::filesystem;
using namespace vdbfrac;
using namespace vdbfrac::fuzz;

namespace {

constexpr unsigned kSeconds = 10;            // for one file
constexpr std::size_t kMemory = 2ull << 30;  // bytes, for a process; under ASan see the options below

void onHang(int)
{
    constexpr char kText[] = "hangs\n";
    [[maybe_unused]] const auto written = ::write(2, kText, sizeof kText - 1);
    ::_exit(1);
}

/// 1 to 20 bytes changed, or cut off, or both; sometimes a number that readers believe at their peril.
std::string mutated(std::string bytes, std::uint64_t seed)
{
    std::mt19937_64 random(seed);
    const auto below = [&](std::size_t n) { return std::size_t(random() % std::max<std::size_t>(n, 1)); };
    constexpr std::array<std::uint32_t, 6> kNumbers{0, 0xffffffff, 0x7fffffff, 0x80000000, 0x10000, 0x7fc00000};
    const std::size_t reach = random() % 2 ? std::min<std::size_t>(bytes.size(), 1000) : bytes.size();  // headers are short
    switch (random() % 8) {
    case 0: bytes.resize(below(bytes.size() + 1)); break;
    case 1:
        if (bytes.size() > 8) std::memcpy(bytes.data() + below(reach - std::min<std::size_t>(reach, 4)), &kNumbers[below(kNumbers.size())], 4);
        break;
    default:
        for (std::size_t n = 1 + below(20); n > 0 && !bytes.empty(); --n) {
            char& byte = bytes[below(reach)];
            byte = random() % 2 ? char(byte ^ 1 << random() % 8) : char(random());
        }
        if (random() % 16 == 0) bytes.resize(below(bytes.size() + 1));
    }
    return bytes;
}

Outcome readTimed(const Kind& kind, const std::string& bytes)
{
    ::alarm(kSeconds);
    const Outcome outcome = kind.read(bytes);
    ::alarm(0);
    return outcome;
}

int corpus(const fs::path& folder)
{
    for (const Kind& kind : kinds()) {
        fs::create_directories(folder / kind.name);
        int number = 0;
        for (const std::string& bytes : kind.soundFiles()) writeText(folder / kind.name / ("sound_" + std::to_string(number++)), bytes);
    }
    return 0;
}

int replay(const Kind& kind, char** paths, int count)
{
    int files = 0, unreadable = 0;
    const auto read = [&](const fs::path& file) {
        const Outcome outcome = readTimed(kind, readText(file));
        ++files;
        const bool failed = file.filename().string().starts_with("sound_") && outcome != Outcome::read;
        if (failed) std::printf("%s: %s\n", file.c_str(), kOutcomeNames[int(outcome)]);
        unreadable += failed;
    };
    for (int i = 0; i < count; ++i) {
        if (!fs::is_directory(paths[i])) {
            read(paths[i]);
            continue;
        }
        for (const auto& entry : fs::recursive_directory_iterator(paths[i]))
            if (entry.is_regular_file()) read(entry.path());
    }
    std::printf("%d files of kind %s\n", files, kind.name);
    return files == 0 || unreadable > 0;
}

/// What a process that reads mutations tells the one that waits for it.
struct Progress {
    std::array<std::size_t, 4> counts{};
    std::uint64_t seed = 0;  // of the file being read
};

/// Reads mutations from progress.seed up to `end`; a process of its own, so that one that breaks does not end them all,
/// and what OpenVDB leaks goes with it.
void readMutations(const Kind& kind, const std::vector<std::string>& sound, std::uint64_t end, Progress& progress)
{
    for (; progress.seed < end; ++progress.seed) {
        const std::string bytes = mutated(sound[progress.seed % sound.size()], progress.seed);
        try {
            ++progress.counts[std::size_t(readTimed(kind, bytes))];
        } catch (const std::exception& e) {
            std::fprintf(stderr, "not a named error: %s\n", e.what());
            ::_exit(1);
        }
    }
    ::_exit(0);
}

/// Returns how many broke the reader; each is kept as a file.
std::size_t runMutations(const Kind& kind, std::uint64_t first, std::size_t count, Progress& progress)
{
    constexpr std::uint64_t kBatch = 100;  // files a process
    const std::vector<std::string> sound = kind.soundFiles();
    std::size_t broken = 0;
    progress = {{}, first};
    while (progress.seed < first + count) {
        const ::pid_t child = ::fork();
        if (child == 0) readMutations(kind, sound, std::min(progress.seed + kBatch, first + count), progress);
        int status = 0;
        if (child < 0 || ::waitpid(child, &status, 0) != child) throw std::runtime_error("no process can be started");
        if (status == 0) continue;
        const std::string name = std::string("breaker_") + kind.name + "_" + std::to_string(progress.seed);
        writeText(name, mutated(sound[progress.seed % sound.size()], progress.seed));
        std::printf("%s breaks the reader\n", name.c_str());
        ++broken;
        ++progress.seed;
    }
    return broken;
}

long largestChild()
{
    rusage usage{};
    ::getrusage(RUSAGE_CHILDREN, &usage);
    return usage.ru_maxrss / 1024;
}

int mutate(std::size_t count, std::uint64_t seed)
{
    void* shared = ::mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED) throw std::runtime_error("no shared memory");
    Progress& progress = *new (shared) Progress;
    std::printf("%-8s %9s %8s %12s %11s %12s %7s %15s\n", "kind", "mutations", kOutcomeNames[0], kOutcomeNames[1], kOutcomeNames[2], kOutcomeNames[3],
                "broken", "peak so far, MB");
    bool good = true;
    for (const Kind& kind : kinds()) {
        const std::size_t share = (count + kinds().size() - 1) / kinds().size();
        const std::size_t broken = runMutations(kind, seed, share, progress);
        const auto& c = progress.counts;
        std::printf("%-8s %9zu %8zu %12zu %11zu %12zu %7zu %15ld\n", kind.name, share, c[0], c[1], c[2], c[3], broken, largestChild());
        good = good && broken == 0 && c[0] < share;  // were none refused, nothing would have been mutated
    }
    return good ? 0 : 1;
}

}  // namespace

#if defined(__SANITIZE_ADDRESS__)
/// A file of some kB has no use for a large allocation: an abort, not a bad_alloc that a reader would catch. OpenVDB leaks
/// the node it is reading when it throws, so leaks are not looked for.
extern "C" const char* __asan_default_options() { return "max_allocation_size_mb=1024:hard_rss_limit_mb=2048:detect_leaks=0"; }
#endif

int main(int argc, char** argv)
{
#if !defined(__SANITIZE_ADDRESS__)
    const rlimit limit{kMemory, kMemory};
    ::setrlimit(RLIMIT_AS, &limit);
#endif
    std::setvbuf(stdout, nullptr, _IOLBF, 0);  // what was found is seen also when the next file ends the program
    std::signal(SIGALRM, onHang);
    const ThreadLimit one(1);
    const std::string_view what = argc > 2 ? argv[1] : "";
    if (what == "corpus") return corpus(argv[2]);
    if (what == "replay" && argc > 3) return replay(kindOf(argv[2]), argv + 3, argc - 3);
    if (what == "mutate") return mutate(std::strtoull(argv[2], nullptr, 10), argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 1);
    std::fputs("fuzz_driver corpus DIR | replay KIND PATH... | mutate COUNT [SEED]\n", stderr);
    return 2;
}
