// A body as what carries points on one side of its cracks. Not installed.
#pragma once

#include <vdbfrac/skin/riders.h>

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

namespace vdbfrac::skin {

struct Carrier {
    const tetmesh::BodyMesh& body;
    const FragmentAt& fragment;
    std::span<const std::uint32_t> fragmentOfNode;

    bool hasMaterial(Coord voxel) const { return body.phi()(voxel) < 0; }
    std::optional<std::uint32_t> fragmentAt(Coord voxel) const { return fragment ? fragment(voxel) : std::nullopt; }

    /// The tets with material round a voxel node that are of its side; none where it has no material.
    std::vector<tetmesh::TetShare> tetsAt(Coord voxel) const
    {
        return hasMaterial(voxel) ? tetsAt(voxel, fragmentAt(voxel)) : std::vector<tetmesh::TetShare>();
    }
    /// The same of a fragment, if one is given.
    std::vector<tetmesh::TetShare> tetsAt(Coord voxel, std::optional<std::uint32_t> side) const
    {
        std::vector<tetmesh::TetShare> tets;
        body.addTetsRound(voxel, tets);
        std::erase_if(tets, [&](const tetmesh::TetShare& tet) {
            const tetmesh::CellElement& element = body.elements()[tet.element];
            const int corner = tetmesh::cellTets(element.shape).corner[std::size_t(tet.tet)][0];
            return side && fragmentOfNode[element.node[std::size_t(corner)]] != *side;
        });
        std::ranges::sort(tets, {}, [](const tetmesh::TetShare& tet) { return std::pair(tet.element, tet.tet); });
        return tets;
    }
};

}  // namespace vdbfrac::skin
