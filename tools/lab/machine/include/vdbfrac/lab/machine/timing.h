// Seconds by the clock.
#pragma once

#include <algorithm>
#include <chrono>
#include <limits>

namespace vdbfrac::lab::bench {

template <class Work>
double secondsOf(const Work& work)
{
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Of the fastest repetition: that in which nobody else wanted a core.
template <class Work>
double fastest(int repetitions, const Work& work)
{
    double best = std::numeric_limits<double>::infinity();
    for (int r = 0; r < repetitions; ++r) best = std::min(best, secondsOf(work));
    return best;
}

}  // namespace vdbfrac::lab::bench
