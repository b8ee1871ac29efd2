// Parallel loops whose results do not depend on the number of threads.
#pragma once

#include <cstddef>
#include <functional>

namespace vdbfrac {

/// Calls body(begin, end) for consecutive chunks of [0, count), each `chunk` long (the last may be shorter).
/// The chunks depend on `count` and `chunk` alone, so anything computed per chunk is the same for any
/// number of threads. body must only write what belongs to its chunk.
void parallelChunks(std::size_t count, std::size_t chunk,
                    const std::function<void(std::size_t begin, std::size_t end)>& body);

/// Sum over [0, count) of what term(begin, end) returns for each chunk, added in chunk order.
double orderedSum(std::size_t count, std::size_t chunk,
                  const std::function<double(std::size_t begin, std::size_t end)>& term);

/// Largest of what term(begin, end) returns for each chunk; `least` when count is 0.
double orderedMax(std::size_t count, std::size_t chunk, double least,
                  const std::function<double(std::size_t begin, std::size_t end)>& term);

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

/// Elements a chunk holds in loops over plain node or element data.
inline constexpr std::size_t kChunk = 2048;

}  // namespace vdbfrac
