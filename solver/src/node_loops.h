// Loops over nodes, in chunks. Those in single precision flush denormals. Not installed.
#pragma once

#include "flush_denormals.h"
#include "kernel.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/solver/elastic_operator.h>

#include <cstddef>
#include <type_traits>

namespace vdbfrac::solver {

/// Flushes denormals while it lives if Real is float.
template <class Real>
using FlushFor = std::conditional_t<std::is_same_v<Real, float>, FlushDenormals, int>;

template <class Real, class F>
void eachNode(std::size_t count, const F& f)
{
    parallelChunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
        [[maybe_unused]] const FlushFor<Real> flush{};
        for (std::size_t i = begin; i < end; ++i) f(i);
    });
}

/// `sums` as kernels take them.
template <class V>
SlotSums<typename V::Scalar> slotSums(const NodeSums<V>& sums)
{
    return {sums.slot->data(), sums.contiguous, sums.start, sums.slots};
}

/// Sum of term(i), in a fixed order.
template <class Real, class F>
double nodeSum(std::size_t count, const F& term)
{
    return orderedSum(count, kChunk, [&](std::size_t begin, std::size_t end) {
        [[maybe_unused]] const FlushFor<Real> flush{};
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) sum += term(i);
        return sum;
    });
}

}  // namespace vdbfrac::solver
