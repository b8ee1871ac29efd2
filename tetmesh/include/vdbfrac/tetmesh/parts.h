// Parts of a material: voxel nodes that hang together by edges of Kuhn's tets.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/node_field.h>
#include <vdbfrac/tetmesh/stencil.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

namespace vdbfrac::tetmesh {

/// Calls visit(node) for the ends of the edges at a node.
template <class Visit>
void forNeighbours(Coord n, const Visit& visit)
{
    for (int mask = 1; mask < 8; ++mask)
        for (const int sign : {1, -1}) visit(n + sign * cornerOffset(mask));
}

using PartNames = NodeField<std::uint32_t>;
inline constexpr std::uint32_t kNameless = std::numeric_limits<std::uint32_t>::max();

/// Names each node by the number of the first one, among `material`, of the part that it is in. `part` covers them, and
/// is nameless. Returns how many parts there are.
std::size_t nameParts(std::span<const Coord> material, PartNames& part);

}  // namespace vdbfrac::tetmesh
