#include "coupled_diagonal.h"

#include <algorithm>
#include <cmath>

namespace vdbfrac::solver {

CoupledDiagonal::CoupledDiagonal(const NodeBlocks* blocks)
{
    for (std::size_t r = 0; blocks && r < blocks->rows(); ++r) {
        const SymmetricBlock& own = blocks->diagonal(r);
        traces_.emplace_back(blocks->node(r), double(own[0]) + double(own[1]) + double(own[2]));
    }
}

bool CoupledDiagonal::changesMuch(const NodeBlocks* now) const
{
    constexpr double kMuch = 0.05;  // of their sum
    double change = 0, size = 0;
    auto a = traces_.begin();
    for (const auto& [node, trace] : CoupledDiagonal(now).traces_) {
        for (; a != traces_.end() && a->first < node; ++a) change += a->second, size += a->second;
        const double was = a != traces_.end() && a->first == node ? a++->second : 0;
        change += std::abs(trace - was), size += std::max(trace, was);
    }
    for (; a != traces_.end(); ++a) change += a->second, size += a->second;
    return change > kMuch * size;
}

bool CoupledDiagonal::growsMuch(const LinearSystem& now) const
{
    constexpr double kGrowth = 0.5;  // of what it had, with its elastic part
    auto a = traces_.begin();
    for (const auto& [node, trace] : CoupledDiagonal(now.blocks).traces_) {
        while (a != traces_.end() && a->first < node) ++a;
        const double was = a != traces_.end() && a->first == node ? a->second : 0;
        if (trace - was > kGrowth * (was + now.elastic.stiffness()[node])) return true;
    }
    return false;
}

}  // namespace vdbfrac::solver
