// The fuzz targets without a fuzzer:
//   fuzz_driver corpus DIR             writes the sound files into DIR/KIND/
//   fuzz_driver broken DIR COUNT       writes the first COUNT mutations of each kind into DIR, as files with its
//   extension fuzz_driver replay KIND PATH...    runs the commands on files, or on all files of folders fuzz_driver
//   mutate COUNT [SEED [KIND]]   runs them on COUNT mutations of sound files, of all kinds in equal shares, and
//                                      prints how they ended
#include "inputs.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/parallel.h>

#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <new>
#include <random>
#include <span>
#include <stdexcept>

#if defined(__SANITIZE_ADDRESS__)  // GCC
#define VDBFRAC_SANITIZED
#elif defined(__has_feature)  // Clang
#if __has_feature(address_sanitizer)
#define VDBFRAC_SANITIZED
#endif
#endif

namespace fs = std::filesystem;
using namespace vdbfrac;
using namespace vdbfrac::fuzz;

namespace {

constexpr time_t kSeconds = 10;  // of the processor for one file: a busy machine is no hang

void onHang(int)
{
    constexpr char kText[] = "hangs\n";
    [[maybe_unused]] const auto written = ::write(2, kText, sizeof kText - 1);
    ::_exit(1);
}

/// Other digits in place of up to `count` digits: text stays text, and says something else.
void changeDigits(std::string& bytes, std::size_t count, std::mt19937_64& random)
{
    for (; count > 0 && !bytes.empty(); --count) {
        const std::size_t found = bytes.find_first_of("0123456789", std::size_t(random() % bytes.size()));
        if (found != std::string::npos) bytes[found] = char('0' + random() % 10);
    }
}

/// 1 to 20 bytes changed, or cut off, or both; sometimes a number that readers believe at their peril, or digits alone.
std::string mutated(std::string bytes, std::uint64_t seed)
{
    std::mt19937_64 random(seed);
    const auto below = [&](std::size_t n) { return std::size_t(random() % std::max<std::size_t>(n, 1)); };
    constexpr std::array<std::uint32_t, 6> kNumbers{0, 0xffffffff, 0x7fffffff, 0x80000000, 0x10000, 0x7fc00000};
    // Headers are short.
    const std::size_t reach = random() % 2 ? std::min<std::size_t>(bytes.size(), 1000) : bytes.size();
    switch (random() % 8) {
    case 0: bytes.resize(below(bytes.size() + 1)); break;
    case 1:
        if (bytes.size() > 8)
            std::memcpy(bytes.data() + below(reach - std::min<std::size_t>(reach, 4)),
                        &kNumbers[below(kNumbers.size())], 4);
        break;
    case 2: changeDigits(bytes, 1 + below(20), random); break;
    default:
        for (std::size_t n = 1 + below(random() % 2 ? 20 : 3); n > 0 && !bytes.empty(); --n) {
            char& byte = bytes[below(reach)];
            byte = random() % 2 ? char(byte ^ 1 << random() % 8) : char(random());
        }
        if (random() % 16 == 0) bytes.resize(below(bytes.size() + 1));
    }
    return bytes;
}

std::vector<Ending> runTimed(const Kind& kind, const std::string& bytes)
{
    const itimerval limit{{}, {kSeconds, 0}}, none{};
    ::setitimer(ITIMER_PROF, &limit, nullptr);
    std::vector<Ending> endings = kind.run(bytes);
    ::setitimer(ITIMER_PROF, &none, nullptr);
    return endings;
}

int corpus(const fs::path& folder)
{
    for (const Kind& kind : kinds()) {
        fs::create_directories(folder / kind.name);
        int number = 0;
        for (const std::string& bytes : kind.soundFiles())
            writeText(folder / kind.name / ("sound_" + std::to_string(number++)), bytes);
    }
    return 0;
}

const std::string& soundFor(const std::vector<std::string>& sound, std::uint64_t seed)
{
    return sound[seed % sound.size()];
}

int broken(const fs::path& folder, std::uint64_t count)
{
    for (const Kind& kind : kinds()) {
        const std::vector<std::string> sound = kind.soundFiles();
        for (std::uint64_t seed = 1; seed <= count; ++seed)
            writeText(folder / (std::string(kind.name) + "_" + std::to_string(seed) + kind.extension),
                      mutated(soundFor(sound, seed), seed));
    }
    return 0;
}

int replay(const Kind& kind, char** paths, int count)
{
    int files = 0, unreadable = 0;
    std::vector<int> done(kind.commands.size());  // of the sound files
    const auto read = [&](const fs::path& file) {
        const std::vector<Ending> endings = runTimed(kind, readText(file));
        ++files;
        if (!file.filename().string().starts_with("sound_")) return;
        for (std::size_t c = 0; c < endings.size(); ++c) done[c] += endings[c] == Ending::done;
        if (endings[0] == Ending::done) return;
        std::printf("%s: %s\n", file.c_str(), kEndingNames[int(endings[0])]);
        ++unreadable;
    };
    for (int i = 0; i < count; ++i) {
        if (!fs::is_directory(paths[i])) {
            read(paths[i]);
            continue;
        }
        for (const auto& entry : fs::recursive_directory_iterator(paths[i]))
            if (entry.is_regular_file()) read(entry.path());
    }
    std::printf("%d files of kind %s, sound and done:", files, kind.name);
    for (std::size_t c = 0; c < done.size(); ++c) std::printf(" %s %d", kind.commands[c], done[c]);
    std::printf("\n");
    // Not every command takes every sound file, but each takes some.
    if (std::any_of(done.begin(), done.end(), [](int n) { return n > 0; }))
        unreadable += int(std::count(done.begin(), done.end(), 0));
    return files == 0 || unreadable > 0;
}

/// What a process that runs mutations tells the one that waits for it.
struct Progress {
    std::array<std::array<std::size_t, 4>, 3> counts{};  // of each command, by ending
    std::uint64_t seed = 0;                              // of the file being read
};

/// Runs mutations from progress.seed up to `end`; a process of its own, so that one that breaks does not end them all,
/// and what OpenVDB leaks goes with it.
void runBatch(const Kind& kind, const std::vector<std::string>& sound, std::uint64_t end, Progress& progress)
{
    for (; progress.seed < end; ++progress.seed) {
        const std::string bytes = mutated(soundFor(sound, progress.seed), progress.seed);
        try {
            const std::vector<Ending> endings = runTimed(kind, bytes);
            for (std::size_t c = 0; c < endings.size(); ++c) ++progress.counts[c][std::size_t(endings[c])];
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
        if (child == 0) runBatch(kind, sound, std::min(progress.seed + kBatch, first + count), progress);
        int status = 0;
        if (child < 0 || ::waitpid(child, &status, 0) != child) throw std::runtime_error("no process can be started");
        if (status == 0) continue;
        const std::string name = std::string("breaker_") + kind.name + "_" + std::to_string(progress.seed);
        writeText(name, mutated(soundFor(sound, progress.seed), progress.seed));
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

int mutate(std::span<const Kind> kinds, std::size_t count, std::uint64_t seed)
{
    void* shared = ::mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED) throw std::runtime_error("no shared memory");
    Progress& progress = *new (shared) Progress;
    std::printf("%-10s %-8s %9s %8s %12s %12s %8s %7s %15s\n", "kind", "command", "mutations", kEndingNames[0],
                kEndingNames[1], kEndingNames[2], kEndingNames[3], "broken", "peak so far, MB");
    bool good = true;
    for (const Kind& kind : kinds) {
        const std::size_t share = (count + kinds.size() - 1) / kinds.size();
        const std::size_t broken = runMutations(kind, seed, share, progress);
        for (std::size_t command = 0; command < kind.commands.size(); ++command) {
            const auto& c = progress.counts[command];
            std::printf("%-10s %-8s %9zu %8zu %12zu %12zu %8zu %7zu %15ld\n", kind.name, kind.commands[command], share,
                        c[0], c[1], c[2], c[3], broken, largestChild());
            // Were none refused, nothing would have been mutated; were none done, only the first look at a file was
            // tried.
            good = good && broken == 0 && c[0] > 0 && c[0] < share;
        }
    }
    return good ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv)
{
#if !defined(VDBFRAC_SANITIZED)
    // Bytes, for a process; the sanitizer's own limit is in __asan_default_options.
    constexpr rlim_t kMemory = 2ull << 30;
    const rlimit limit{kMemory, kMemory};
    ::setrlimit(RLIMIT_AS, &limit);
#endif
    std::setvbuf(stdout, nullptr, _IOLBF, 0);  // what was found is seen also when the next file ends the program
    std::signal(SIGPROF, onHang);
    const ThreadLimit one(1);
    const std::string_view what = argc > 2 ? argv[1] : "";
    if (what == "corpus") return corpus(argv[2]);
    if (what == "broken" && argc > 3) return broken(argv[2], std::strtoull(argv[3], nullptr, 10));
    if (what == "replay" && argc > 3) return replay(kindOf(argv[2]), argv + 3, argc - 3);
    if (what == "mutate")
        return mutate(argc > 4 ? std::span(&kindOf(argv[4]), 1) : std::span(kinds()),
                      std::strtoull(argv[2], nullptr, 10), argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 1);
    std::fputs("fuzz_driver corpus DIR | broken DIR COUNT | replay KIND PATH... | mutate COUNT [SEED [KIND]]\n",
               stderr);
    return 2;
}
