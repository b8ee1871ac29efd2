#include <vdbfrac/base/parallel.h>

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <vector>

namespace vdbfrac {

void parallelChunks(std::size_t count, std::size_t chunk, ChunkBody<void> body)
{
    if (count == 0) return;
    const std::size_t chunks = (count + chunk - 1) / chunk;
    const auto run = [&](std::size_t c) { body(c * chunk, std::min(count, (c + 1) * chunk)); };
    if (chunks == 1) run(0);
    // Isolated: a thread that waits for the end of a loop within a loop takes no other work of the outer one meanwhile.
    else
        tbb::this_task_arena::isolate([&] { tbb::parallel_for(std::size_t{0}, chunks, run); });
}

namespace {

/// What each chunk returned, on the stack unless the loop is very long.
class PerChunk {
public:
    PerChunk(std::size_t count, std::size_t chunk, const ChunkBody<double>& term) : chunks_((count + chunk - 1) / chunk)
    {
        if (chunks_ > kOnStack) heap_.resize(chunks_);
        double* const part = values();
        parallelChunks(count, chunk,
                       [&, part](std::size_t begin, std::size_t end) { part[begin / chunk] = term(begin, end); });
    }
    const double* begin() { return values(); }
    const double* end() { return values() + chunks_; }

private:
    static constexpr std::size_t kOnStack = 4096;
    double* values() { return heap_.empty() ? stack_ : heap_.data(); }

    std::size_t chunks_;
    double stack_[kOnStack];
    std::vector<double> heap_;
};

}  // namespace

double orderedSum(std::size_t count, std::size_t chunk, ChunkBody<double> term)
{
    double sum = 0;
    for (double part : PerChunk(count, chunk, term)) sum += part;
    return sum;
}

double orderedMax(std::size_t count, std::size_t chunk, double least, ChunkBody<double> term)
{
    double largest = least;
    for (double part : PerChunk(count, chunk, term)) largest = std::max(largest, part);
    return largest;
}

ThreadLimit::ThreadLimit(int threads)
{
    if (threads > 0)
        control_ = new tbb::global_control(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
}

ThreadLimit::~ThreadLimit() { delete static_cast<tbb::global_control*>(control_); }

int threadSlot() { return std::max(0, tbb::this_task_arena::current_thread_index()); }
int threadSlots() { return std::max(tbb::this_task_arena::max_concurrency(), tbb::info::default_concurrency()); }
int threadCount() { return int(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism)); }

}  // namespace vdbfrac
