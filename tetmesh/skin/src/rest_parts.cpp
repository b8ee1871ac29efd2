#include "rest_parts.h"

#include "crack_lattice.h"

#include <vdbfrac/skin/crack_field.h>
#include <vdbfrac/tetmesh/cut.h>
#include <vdbfrac/tetmesh/nodes_around.h>
#include <vdbfrac/tetmesh/nodes_where.h>
#include <vdbfrac/tetmesh/parts.h>

#include <algorithm>
#include <cstdint>
#include <utility>

namespace vdbfrac::skin {

namespace {

using tetmesh::kNameless;
using Labels = tetmesh::PartNames;

/// Gives each of the nodes the name of the nearest part, by edges between them.
void nameNearest(std::vector<Coord> nodes, Labels& part)
{
    while (!nodes.empty()) {
        std::vector<std::pair<Coord, std::uint32_t>> named;
        for (Coord n : nodes) {
            std::uint32_t least = kNameless;
            forNeighbours(n, [&](Coord m) { least = std::min(least, part(m)); });
            if (least != kNameless) named.emplace_back(n, least);
        }
        if (named.empty()) return;
        for (const auto& [n, name] : named) part.set(n, name);
        std::erase_if(nodes, [&](Coord n) { return part(n) != kNameless; });
    }
}

}  // namespace

std::vector<Coord> nodesBetweenParts(const tetmesh::NodeField<float>& rest, double dx)
{
    constexpr int kRound = 3;  // edges from there: parts that lose material are parted elsewhere
    const auto isMaterial = [&](Coord n) { return rest(n) < -tetmesh::kSnap * dx; };
    const auto isBare = [&](Coord n) { return !isMaterial(n) && rest(n) < kBeyond * dx; };
    Labels part(rest.lower(), rest.upper(), kNameless, kNameless);
    const std::vector<Coord> material = tetmesh::nodesWhere(rest, isMaterial);
    part.cover(material);
    if (tetmesh::nameParts(material, part) < 2) return {};
    const std::vector<Coord> bare = tetmesh::nodesWhere(rest, isBare);
    part.cover(bare);
    nameNearest(bare, part);
    std::vector<Coord> between;
    for (Coord n : bare) {
        bool isBetween = false;
        forNeighbours(n, [&](Coord m) { isBetween = isBetween || (part(m) != kNameless && part(m) != part(n)); });
        if (isBetween && part(n) != kNameless) between.push_back(n);
    }
    std::vector<Coord> round = tetmesh::nodesAround(between, kRound);
    std::erase_if(round, [&](Coord n) { return !rest.contains(n) || !isBare(n); });
    return round;
}

}  // namespace vdbfrac::skin
