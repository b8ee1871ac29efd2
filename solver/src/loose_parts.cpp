#include "loose_parts.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace vdbfrac::solver {

namespace {

template <class LabelOf>
void joinNodes(const Coupling& c, const LabelOf& labelOf, DisjointSets& sets)
{
    constexpr std::uint32_t kNone = 0xffffffff;
    std::uint32_t first = kNone;
    for (std::size_t a = 0; a < Coupling::kNodes; ++a) {
        if (c.weight[a] == 0) continue;
        if (first == kNone)
            first = labelOf(c.node[a]);
        else
            sets.join(first, labelOf(c.node[a]));
    }
}

}  // namespace

void LooseParts::find(const Boundary& boundary, std::span<const Coupling> couplings)
{
    label_ = boundary.part;
    const std::size_t count = label_.empty() ? 1 : *std::max_element(label_.begin(), label_.end()) + 1;
    const auto labelOf = [&](std::size_t node) { return label_.empty() ? 0u : label_[node]; };
    nameOf_.resize(count);
    std::iota(nameOf_.begin(), nameOf_.end(), 0u);
    if (!couplings.empty()) {
        DisjointSets sets(count);
        for (const Coupling& c : couplings) joinNodes(c, labelOf, sets);
        nameOf_ = std::move(sets).names();
    }
    held_.assign(count, 0);
    for (std::size_t i = 0; i < boundary.fixed.size(); ++i)
        if (boundary.fixed[i]) held_[(*this)[i]] = 1;
    for (const Coupling& c : couplings)
        for (std::size_t a = 0; c.isExternal() && a < Coupling::kNodes; ++a)
            if (c.weight[a] != 0) held_[(*this)[c.node[a]]] = 1;
}

}  // namespace vdbfrac::solver
