#include <vdbfrac/tetmesh/parts.h>

#include <vdbfrac/base/disjoint_sets.h>

namespace vdbfrac::tetmesh {

std::size_t nameParts(std::span<const Coord> material, PartNames& part)
{
    for (std::uint32_t i = 0; i < material.size(); ++i) part.set(material[i], i);
    DisjointSets sets(material.size());
    for (std::uint32_t i = 0; i < material.size(); ++i)
        forNeighbours(material[i], [&](Coord m) {
            if (part(m) != kNameless) sets.join(i, part(m));
        });
    std::size_t parts = 0;
    for (std::uint32_t i = 0; i < material.size(); ++i) {
        part.set(material[i], sets.find(i));
        parts += sets.find(i) == i;
    }
    return parts;
}

}  // namespace vdbfrac::tetmesh
