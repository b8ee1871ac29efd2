// Parallel loops whose results do not depend on the number of threads.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <type_traits>
#include <vector>

namespace vdbfrac {

/// A callable (begin, end) -> R that is only referred to: passing a loop body costs no allocation.
template <class R>
class ChunkBody {
public:
    template <class F>
    requires(!std::is_same_v<std::remove_cvref_t<F>, ChunkBody>) ChunkBody(const F& body)
        : body_(std::addressof(body)), call_([](const void* f, std::size_t begin, std::size_t end) -> R {
              return (*static_cast<const F*>(f))(begin, end);
          })
    {
    }
    R operator()(std::size_t begin, std::size_t end) const { return call_(body_, begin, end); }

private:
    const void* body_;
    R (*call_)(const void*, std::size_t, std::size_t);
};

/// Calls body(begin, end) for consecutive chunks of [0, count), each `chunk` long (the last may be shorter).
/// The chunks depend on `count` and `chunk` alone, so anything computed per chunk is the same for any
/// number of threads. body must only write what belongs to its chunk.
void parallelChunks(std::size_t count, std::size_t chunk, ChunkBody<void> body);

/// What fill(begin, end, list) puts into a list for each chunk, in chunk order.
template <class T, class Fill>
std::vector<T> gatherChunks(std::size_t count, std::size_t chunk, const Fill& fill)
{
    std::vector<std::vector<T>> part((count + chunk - 1) / chunk);
    parallelChunks(count, chunk, [&](std::size_t begin, std::size_t end) { fill(begin, end, part[begin / chunk]); });
    std::vector<T> all;
    for (const auto& p : part) all.insert(all.end(), p.begin(), p.end());
    return all;
}

/// Leaves the values of which keep(value) is true, in their order; asks of several at a time.
template <class T, class Keep>
void keepIf(std::vector<T>& values, const Keep& keep)
{
    constexpr std::size_t kChunk = 256;
    values = gatherChunks<T>(values.size(), kChunk, [&](std::size_t begin, std::size_t end, std::vector<T>& kept) {
        for (std::size_t i = begin; i < end; ++i)
            if (keep(values[i])) kept.push_back(values[i]);
    });
}

/// Sum over [0, count) of what term(begin, end) returns for each chunk, added in chunk order.
double orderedSum(std::size_t count, std::size_t chunk, ChunkBody<double> term);

/// As orderedSum, for several sums in one pass.
template <std::size_t n>
std::array<double, n> orderedSums(std::size_t count, std::size_t chunk, ChunkBody<std::array<double, n>> term)
{
    constexpr std::size_t kOnStack = 512;
    std::array<double, n> stack[kOnStack], sum{};
    const std::size_t chunks = (count + chunk - 1) / chunk;
    std::vector<std::array<double, n>> heap(chunks > kOnStack ? chunks : 0);
    std::array<double, n>* const part = heap.empty() ? stack : heap.data();
    parallelChunks(count, chunk, [&](std::size_t begin, std::size_t end) { part[begin / chunk] = term(begin, end); });
    for (std::size_t c = 0; c < chunks; ++c)
        for (std::size_t k = 0; k < n; ++k) sum[k] += part[c][k];
    return sum;
}

/// Largest of what term(begin, end) returns for each chunk; `least` when count is 0.
double orderedMax(std::size_t count, std::size_t chunk, double least, ChunkBody<double> term);

/// Limits the number of threads while it lives. 0 leaves the choice to TBB (all cores).
class ThreadLimit {
public:
    explicit ThreadLimit(int threads);
    ~ThreadLimit();
    ThreadLimit(const ThreadLimit&) = delete;
    ThreadLimit& operator=(const ThreadLimit&) = delete;

private:
    void* control_ = nullptr;  // tbb::global_control, kept out of this header
};

/// Number of threads a parallel loop may use now.
int threadCount();
/// Number of the calling thread among those that run a parallel loop, below threadSlots(): picks its scratch memory.
int threadSlot();
/// For scratch memory that is made once: what is made in an arena of a few threads can be used in any that is no larger
/// than the machine.
int threadSlots();

/// Elements a chunk holds in loops over plain node or element data.
inline constexpr std::size_t kChunk = 2048;

}  // namespace vdbfrac
