#include "coupled_diagonal.h"

#include <algorithm>
#include <cmath>

namespace vdbfrac::solver {

CoupledDiagonal::CoupledDiagonal(const NodeBlocks* blocks)
{
    for (std::size_t r = 0; blocks && r < blocks->rows(); ++r) {
        const SymmetricBlock own = blocks->diagonal(r);
        traces_.emplace_back(blocks->node(r), double(own[0]) + double(own[1]) + double(own[2]));
    }
}

template <class Visit>
void CoupledDiagonal::eachCoupled(const CoupledDiagonal& now, const Visit& visit) const
{
    auto a = traces_.begin();
    for (const auto& [node, trace] : now.traces_) {
        for (; a != traces_.end() && a->first < node; ++a) visit(a->first, a->second, 0.);
        visit(node, a != traces_.end() && a->first == node ? a++->second : 0., trace);
    }
    for (; a != traces_.end(); ++a) visit(a->first, a->second, 0.);
}

bool CoupledDiagonal::changesMuch(const CoupledDiagonal& now) const
{
    constexpr double kMuch = 0.05;  // of their sum
    double change = 0, size = 0;
    eachCoupled(now,
                [&](std::uint32_t, double was, double is) { change += std::abs(is - was), size += std::max(is, was); });
    return change > kMuch * size;
}

bool CoupledDiagonal::growsMuch(const CoupledDiagonal& now, std::span<const double> stiffness) const
{
    constexpr double kGrowth = 0.5;  // of what it had, with its elastic part
    bool grows = false;
    eachCoupled(now, [&](std::uint32_t node, double was, double is) {
        grows = grows || is - was > kGrowth * (was + stiffness[node]);
    });
    return grows;
}

}  // namespace vdbfrac::solver
