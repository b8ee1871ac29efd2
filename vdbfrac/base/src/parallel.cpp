#include <vdbfrac/base/parallel.h>

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <vector>

namespace vdbfrac {

void parallelChunks(std::size_t count, std::size_t chunk,
                    const std::function<void(std::size_t, std::size_t)>& body)
{
    if (count == 0) return;
    const std::size_t chunks = (count + chunk - 1) / chunk;
    const auto run = [&](std::size_t c) { body(c * chunk, std::min(count, (c + 1) * chunk)); };
    if (chunks == 1)
        run(0);
    else
        tbb::parallel_for(std::size_t{0}, chunks, run);
}

namespace {

std::vector<double> perChunk(std::size_t count, std::size_t chunk,
                             const std::function<double(std::size_t, std::size_t)>& term)
{
    std::vector<double> part((count + chunk - 1) / chunk);
    parallelChunks(count, chunk, [&](std::size_t begin, std::size_t end) { part[begin / chunk] = term(begin, end); });
    return part;
}

}  // namespace

double orderedSum(std::size_t count, std::size_t chunk, const std::function<double(std::size_t, std::size_t)>& term)
{
    double sum = 0;
    for (double p : perChunk(count, chunk, term)) sum += p;
    return sum;
}

double orderedMax(std::size_t count, std::size_t chunk, double least,
                  const std::function<double(std::size_t, std::size_t)>& term)
{
    double largest = least;
    for (double p : perChunk(count, chunk, term)) largest = std::max(largest, p);
    return largest;
}

ThreadLimit::ThreadLimit(int threads)
{
    if (threads > 0)
        control_ = new tbb::global_control(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
}

ThreadLimit::~ThreadLimit() { delete static_cast<tbb::global_control*>(control_); }

int threadCount() { return int(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism)); }

}  // namespace vdbfrac
