// The nodes of a field that have some property.
#pragma once

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/node_field.h>

#include <vector>

namespace vdbfrac::tetmesh {

/// Nodes for which isOne(node) is true, of blocks that may hold anything but `outside`: block by block, x fastest. Asks
/// of several at a time.
template <class T, class IsOne>
std::vector<Coord> nodesWhere(const NodeField<T>& field, const IsOne& isOne)
{
    std::vector<Coord> blocks;
    field.forEachBlock([&](Coord low) { blocks.push_back(low); });
    return gatherChunks<Coord>(blocks.size(), 1, [&](std::size_t b, std::size_t, std::vector<Coord>& found) {
        NodeField<T>::forEachNode(blocks[b], [&](Coord c) {
            if (isOne(c)) found.push_back(c);
        });
    });
}

}  // namespace vdbfrac::tetmesh
