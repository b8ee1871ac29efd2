// Render meshes of boxes with faces on planes of voxels.
#pragma once

#include <vdbfrac/tetmesh/render_mesh.h>
#include <vdbfrac/tetmesh/surface_input.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace vdbfrac::test {

/// A box of whole voxels, one point a voxel node on its surface.
inline tetmesh::RenderMesh voxelBox(const Coord& half, double dx)
{
    tetmesh::PolygonSoup soup;
    for (int axis = 0; axis < 3; ++axis)
        for (const int side : {-1, 1}) {
            const Coord size = half;
            const int n[3] = {size.x, size.y, size.z}, u = (axis + 1) % 3, v = (axis + 2) % 3;
            for (int j = -n[v]; j < n[v]; ++j)
                for (int i = -n[u]; i < n[u]; ++i) {
                    std::vector<std::size_t> square;
                    for (const auto& [di, dj] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
                        Vec3 p;
                        p[axis] = side * n[axis], p[u] = i + di, p[v] = j + dj;
                        square.push_back(soup.points.size());
                        soup.points.push_back(dx * p);
                    }
                    if (side < 0) std::reverse(square.begin(), square.end());
                    soup.polygons.push_back(square);
                }
        }
    return tetmesh::renderMesh(soup);
}

/// Each face with its normal.
inline tetmesh::RenderMesh withNormals(tetmesh::RenderMesh mesh)
{
    for (std::size_t f = 0; f < mesh.faces(); ++f) {
        const auto face = std::span(mesh.corners).subspan(4 * f, 4);
        const auto at = [&](std::size_t k) { return mesh.points[face[k].point]; };
        for (auto& corner : face) corner.normal = std::uint32_t(f);
        mesh.normals.push_back((at(1) - at(0)).cross(at(2) - at(0)).normalized());
    }
    return mesh;
}

}  // namespace vdbfrac::test
