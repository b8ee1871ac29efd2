// Meshes of tets without a mesher.
#pragma once

#include <vdbfrac/tetmesh/stencil.h>
#include <vdbfrac/tetmesh/tet_mesh.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>

namespace vdbfrac::test {

/// Tets of a box of `reach` voxels on each side of the origin, six a cell of `m` voxels of dx; points inside are moved
/// by up to `shake` of an edge.
inline tetmesh::TetMesh tetsOfBox(int reach, int m, double shake, double dx)
{
    const int side = 2 * reach / m + 1;
    const auto number = [&](Coord c) { return std::uint32_t((c.z * side + c.y) * side + c.x); };
    std::mt19937 random(7);
    std::uniform_real_distribution<double> move(-shake * m * dx, shake * m * dx);
    tetmesh::TetMesh mesh;
    for (int z = 0; z < side; ++z)
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x) {
                const bool inside = std::min({x, y, z}) > 0 && std::max({x, y, z}) < side - 1;
                Vec3 p = dx * Vec3(m * x - reach, m * y - reach, m * z - reach);
                if (inside && shake > 0) p += Vec3(move(random), move(random), move(random));
                mesh.points.push_back(p);
            }
    const auto& cell = tetmesh::cellTets(tetmesh::CellShape::six);
    for (int z = 0; z + 1 < side; ++z)
        for (int y = 0; y + 1 < side; ++y)
            for (int x = 0; x + 1 < side; ++x)
                for (std::size_t t = 0; t < 6; ++t) {
                    std::array<std::uint32_t, 4> tet{};
                    for (std::size_t a = 0; a < 4; ++a)
                        tet[a] = number(Coord{x, y, z} + tetmesh::cornerOffset(cell.corner[t][a]));
                    mesh.tets.push_back(tet);
                }
    return mesh;
}

}  // namespace vdbfrac::test
