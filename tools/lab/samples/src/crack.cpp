#include <vdbfrac/lab/samples/crack.h>

#include <map>

namespace vdbfrac::lab {

void openCrack(Block& block, NodePlane plane, const std::function<bool(Coord)>& open)
{
    std::map<std::uint32_t, std::uint32_t> copy;
    for (auto& e : block.elements) {
        if (block.nodes[e.node[0]].*plane.axis < plane.at) continue;  // corner 0 is the lowest of the cell
        for (std::uint32_t& n : e.node) {
            if (block.nodes[n].*plane.axis != plane.at || !open(block.nodes[n])) continue;
            const auto [at, isNew] = copy.insert({n, std::uint32_t(block.nodes.size())});
            if (isNew) block.nodes.push_back(block.nodes[n]);
            n = at->second;
        }
    }
}

}  // namespace vdbfrac::lab
