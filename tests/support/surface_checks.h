// What every surface of a cut mesh has to be: closed, oriented, and round the material.
#pragma once

#include "block.h"

#include <vdbfrac/tetmesh/body_mesh.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <utility>

namespace vdbfrac::test {

/// Every directed edge of the surface has exactly one triangle, and its reverse exactly one other.
inline void expectClosed(const tetmesh::BodyMesh& mesh)
{
    const auto surface = mesh.surface();
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> count;
    for (const auto& t : surface.triangles)
        for (std::size_t k = 0; k < 3; ++k) ++count[{t[k], t[(k + 1) % 3]}];
    std::size_t open = 0, crowded = 0;
    for (const auto& [edge, n] : count) {
        const auto reverse = count.find({edge.second, edge.first});
        open += reverse == count.end() || reverse->second != n;
        crowded += n != 1;
    }
    EXPECT_EQ(open, 0u) << "edges whose faces do not match";
    EXPECT_EQ(crowded, 0u) << "edges with more than two faces";
    EXPECT_EQ(surface.torn.size(), surface.triangles.size());
}

/// Volume within the surface at rest [m^3], by the divergence theorem.
inline double enclosedVolume(const tetmesh::BodyMesh& mesh)
{
    const auto surface = mesh.surface();
    const auto rest = tetmesh::restPositions(mesh);
    double volume = 0;
    for (const auto& t : surface.triangles)
        volume +=
            surface.points[t[0]].at(rest).dot(surface.points[t[1]].at(rest).cross(surface.points[t[2]].at(rest))) / 6;
    return volume;
}

}  // namespace vdbfrac::test
