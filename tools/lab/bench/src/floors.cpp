#include <vdbfrac/lab/bench/floors.h>

#include "floor_kernel.h"

#include <algorithm>
#include <barrier>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <thread>

namespace vdbfrac::lab::bench {

#if defined(__x86_64__)
extern const FloorKernel floorAvx2, floorAvx512;
#endif
extern const FloorKernel floorBaseline;

const FloorKernel& floorKernel()
{
#if defined(__x86_64__)
    // The element kernel asks for the same parts of AVX-512.
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
        return floorAvx512;
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return floorAvx2;
#endif
    return floorBaseline;
}

const char* vectorUnit() { return floorKernel().name; }

namespace {

constexpr double kMiB = 1024. * 1024;
constexpr double kFootprints[] = {1 * kMiB, 8 * kMiB, 32 * kMiB, 64 * kMiB, 256 * kMiB};
constexpr int kRepetitions = 15;  // the best one counts: that in which nobody else wanted a core
constexpr double kMoved =
    384 * kMiB;  // bytes a thread moves in a repetition: milliseconds, so that waking up is nothing
constexpr std::size_t kRounds = 1 << 21;  // of multiply-adds in a repetition

using Clock = std::chrono::steady_clock;

/// What one thread does: `touch` once, then `work` in every repetition.
struct Task {
    std::function<void(std::size_t thread)> touch, work;
};

/// Seconds of the fastest of several repetitions, from the first thread's start to the last one's end. Plain threads
/// and not the loops of the library: all of them have to work at the same time, each on memory that it touched first.
double bestSeconds(int threads, const Task& task)
{
    std::vector<std::vector<Clock::time_point>> start(kRepetitions,
                                                      std::vector<Clock::time_point>(std::size_t(threads))),
        end = start;
    std::barrier together(threads);
    {
        std::vector<std::jthread> pool;
        for (std::size_t t = 0; t < std::size_t(threads); ++t)
            pool.emplace_back([&, t] {
                task.touch(t);
                for (std::size_t r = 0; r < kRepetitions; ++r) {
                    together.arrive_and_wait();
                    start[r][t] = Clock::now();
                    task.work(t);
                    end[r][t] = Clock::now();
                }
            });
    }
    double best = std::numeric_limits<double>::infinity();
    for (std::size_t r = 0; r < kRepetitions; ++r) {
        const auto first = *std::min_element(start[r].begin(), start[r].end()),
                   last = *std::max_element(end[r].begin(), end[r].end());
        best = std::min(best, std::chrono::duration<double>(last - first).count());
    }
    return best;
}

/// An array for each thread, allocated but not yet touched.
using Arrays = std::vector<std::vector<double>>;
Arrays reserve(int threads, std::size_t count)
{
    Arrays arrays(static_cast<std::size_t>(threads));
    for (auto& a : arrays) a.reserve(count);
    return arrays;
}

/// Values that are no special case of anything.
void fill(std::vector<double>& values, std::size_t count)
{
    values.resize(count);
    for (std::size_t i = 0; i < count; ++i) values[i] = 1 + double(i % 1021) * 1e-3;
}

int passesOver(double bytes) { return std::max(1, int(std::lround(kMoved / bytes))); }

double measureRead(int threads, double footprint)
{
    const auto count = std::size_t(footprint / threads / sizeof(double));
    const int passes = passesOver(footprint / threads);
    Arrays values = reserve(threads, count);
    std::vector<double> sums(values.size(), 0.);  // used below, so that nothing can be left out
    const Task task = {[&](std::size_t t) { fill(values[t], count); },
                       [&](std::size_t t) {
                           double sum = 0;
                           for (int p = 0; p < passes; ++p) sum += floorKernel().read(values[t].data(), count);
                           sums[t] = sum;
                       }};
    const double seconds = bestSeconds(threads, task);
    const bool sound = std::all_of(sums.begin(), sums.end(), [](double s) { return s > 0; });
    return sound ? double(threads) * double(count) * sizeof(double) * passes / seconds : 0;
}

double measureTriad(int threads, double footprint)
{
    const auto count = std::size_t(footprint / threads / (3 * sizeof(double)));
    const int passes = passesOver(footprint / threads);
    Arrays a = reserve(threads, count), b = reserve(threads, count), c = reserve(threads, count);
    const Task task = {[&](std::size_t t) {
                           fill(a[t], count);
                           fill(b[t], count);
                           fill(c[t], count);
                       },
                       [&](std::size_t t) {
                           for (int p = 0; p < passes; ++p)
                               floorKernel().triad(a[t].data(), b[t].data(), c[t].data(), 0.5 + a[t][0] * 1e-9, count);
                       }};
    const double seconds = bestSeconds(threads, task);
    return double(threads) * double(count) * 3 * sizeof(double) * passes / seconds;
}

double measureMultiplyAdds(int threads)
{
    std::vector<double> results(std::size_t(threads), 0.);
    const double seconds = bestSeconds(
        threads, {[](std::size_t) {}, [&](std::size_t t) { results[t] = floorKernel().multiplyAdd(kRounds); }});
    const bool sound = std::all_of(results.begin(), results.end(), [](double r) { return std::isfinite(r) && r != 0; });
    return sound ? threads * double(kRounds) * floorKernel().flopsOfRound / seconds : 0;
}

}  // namespace

Floors measureFloors(int threads)
{
    Floors floors;
    for (int t : std::set<int>{1, threads}) {
        for (double footprint : kFootprints)
            floors.memory.push_back({t, footprint, measureRead(t, footprint), measureTriad(t, footprint)});
        floors.arithmetic.push_back({t, measureMultiplyAdds(t)});
    }
    return floors;
}

double Floors::bandwidth(int threads, double footprint, double Bandwidth::*of) const
{
    const Bandwidth *below = nullptr, *above = nullptr;  // measured footprints on either side; memory is sorted by it
    for (const Bandwidth& b : memory) {
        if (b.threads != threads) continue;
        if (b.footprint <= footprint) below = &b;
        if (b.footprint >= footprint && !above) above = &b;
    }
    if (!below || !above) return below ? below->*of : above ? above->*of : 0;
    if (below == above) return below->*of;
    const double part = std::log(footprint / below->footprint) / std::log(above->footprint / below->footprint);
    return below->*of + part * (above->*of - below->*of);
}

double Floors::seconds(int threads, const Traffic& traffic) const
{
    const double inTriads = std::min(3 * traffic.written, traffic.bytes());
    return inTriads / bandwidth(threads, traffic.bytes(), &Bandwidth::triad) +
           (traffic.bytes() - inTriads) / bandwidth(threads, traffic.bytes(), &Bandwidth::read);
}

}  // namespace vdbfrac::lab::bench
