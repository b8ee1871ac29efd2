// The polygons of cut pieces, joined to one surface. Not installed.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/body_mesh.h>

#include <cstdint>
#include <functional>
#include <vector>

namespace vdbfrac::tetmesh {

/// Polygons that share no corners yet.
struct CutPolygons {
    struct Polygon {
        std::uint32_t firstCorner = 0;
        std::uint32_t cell = 0;   ///< index into the cells of a lattice, or the tets of a mesh
        std::uint16_t piece = 0;  ///< of the cell
        std::uint16_t size = 0;   ///< corners
    };
    std::vector<Polygon> polygons;
    std::vector<std::uint64_t> key;   ///< of each corner: names the crossing it is
    std::vector<std::uint64_t> node;  ///< of each corner: key of the outside voxel when the crossing lies on it, else 0
    std::vector<std::uint8_t> torn;   ///< of each corner: was the outside voxel material at rest?

    /// Adds everything of another soup behind what is here.
    void add(const CutPolygons& other);
};

/// Names the crossing of the voxel edge from an inside to an outside node; with both the same, names the node.
std::uint64_t crossingKey(Coord inside, Coord outside, Coord lower);

/// Index of each corner's point after sharing equal keys and joining neighbours that sit on the same voxel node.
struct Welded {
    std::vector<std::uint32_t> pointOfCorner;
    std::vector<std::uint32_t> cornerOfPoint;  ///< its first; rising
};

/// Joins wherever that leaves a surface with two triangles an edge.
Welded weldManifold(const CutPolygons& soup);

/// Calls visit(corners a, b, c) for each triangle of the polygons whose points are distinct.
template <class Visit>
void forTriangles(const CutPolygons& soup, const Welded& welded, const Visit& visit)
{
    const auto& point = welded.pointOfCorner;
    for (const CutPolygons::Polygon& p : soup.polygons)
        for (std::uint32_t k = 2; k < p.size; ++k) {
            const std::uint32_t a = p.firstCorner, b = a + k - 1, c = a + k;
            if (point[a] != point[b] && point[b] != point[c] && point[c] != point[a]) visit(a, b, c);
        }
}

/// The surface of a soup. `place`: where a corner of a polygon is, given its number in the soup; asked for once a
/// point.
EmbeddedSurface surfaceOf(const BodyMesh& mesh, const CutPolygons& soup,
                          const std::function<EmbeddedPoint(const CutPolygons::Polygon&, std::uint32_t corner)>& place);

}  // namespace vdbfrac::tetmesh
