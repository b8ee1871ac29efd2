// The fuzz targets without a fuzzer:
//   fuzz_driver corpus DIR             writes the sound files into DIR/KIND/
//   fuzz_driver replay KIND PATH...    reads files, or all files of folders
//   fuzz_driver mutate COUNT [SEED]    reads COUNT mutations of sound files, in equal shares, and prints how it ended
#include "inputs.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/parallel.h>

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <random>

namespace fs = std::filesystem;
using namespace vdbfrac;
using namespace vdbfrac::fuzz;

namespace {

constexpr unsigned kSeconds = 10;            // for one file
constexpr std::size_t kMemory = 2ull << 30;  // bytes, for the whole program; under ASan see the options below

volatile std::sig_atomic_t currentSeed = 0;  // for the handler alone

void onHang(int)
{
    char text[64];
    const int length = std::snprintf(text, sizeof text, "hangs: seed %ld\n", long(currentSeed));
    [[maybe_unused]] const auto written = ::write(2, text, std::size_t(length));
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

/// Reads the mutations of a kind; returns how many ended in each way.
std::array<std::size_t, 4> outcomes(const Kind& kind, std::size_t count, std::uint64_t firstSeed)
{
    const std::vector<std::string> sound = kind.soundFiles();
    std::array<std::size_t, 4> counts{};
    for (std::uint64_t i = 0; i < count; ++i) {
        currentSeed = std::sig_atomic_t(firstSeed + i);
        const std::string bytes = mutated(sound[i % sound.size()], firstSeed + i);
        try {
            ++counts[std::size_t(readTimed(kind, bytes))];
        } catch (const std::exception& e) {
            const std::string name = std::string("breaker_") + kind.name + "_" + std::to_string(firstSeed + i);
            writeText(name, bytes);
            std::fprintf(stderr, "%s: not a named error: %s\n", name.c_str(), e.what());
            throw;
        }
    }
    return counts;
}

int mutate(std::size_t count, std::uint64_t seed)
{
    std::printf("%-8s %9s %8s %12s %11s %12s\n", "kind", "mutations", kOutcomeNames[0], kOutcomeNames[1], kOutcomeNames[2], kOutcomeNames[3]);
    bool both = true;
    for (const Kind& kind : kinds()) {
        const std::size_t share = count / kinds().size();
        const auto c = outcomes(kind, share, seed);
        std::printf("%-8s %9zu %8zu %12zu %11zu %12zu\n", kind.name, share, c[0], c[1], c[2], c[3]);
        both = both && c[0] < share;  // were none refused, nothing would have been mutated
    }
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    std::printf("peak memory %ld MB\n", usage.ru_maxrss / 1024);
    return both ? 0 : 1;
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
