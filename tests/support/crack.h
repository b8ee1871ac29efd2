// Cracks along planes of nodes.
#pragma once

#include "block.h"

#include <map>

namespace vdbfrac::test {

/// Parts a block along the lattice plane z = `plane`: the cells above get copies of those of its nodes for which
/// `open(node)`. The other nodes of the plane stay shared; those next to open ones are the crack's front.
template <class Open>
void openCrack(Block& block, int plane, const Open& open)
{
    std::map<std::uint32_t, std::uint32_t> copy;
    for (auto& e : block.elements) {
        if (block.nodes[e.node[0]].z < plane) continue;  // corner 0 is the lowest of the cell
        for (std::uint32_t& n : e.node) {
            if (block.nodes[n].z != plane || !open(block.nodes[n])) continue;
            const auto [at, isNew] = copy.insert({n, std::uint32_t(block.nodes.size())});
            if (isNew) block.nodes.push_back(block.nodes[n]);
            n = at->second;
        }
    }
}

}  // namespace vdbfrac::test
