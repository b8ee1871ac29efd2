// The surface of the material as triangles, with the fragment each belongs to.
#pragma once

#include <vdbfrac/base/vec.h>

#include <array>
#include <cstdint>
#include <vector>

namespace vdbfrac::tetmesh {

/// A closed triangle surface, normals outward (counter-clockwise seen from outside).
struct Surface {
    std::vector<Vec3> points;                             ///< [m]
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices into points
    std::vector<std::uint32_t> fragment;                  ///< of each triangle: the fragment's lasting id
    std::vector<std::uint8_t> torn;                       ///< of each triangle: 1 on a face made by fracture ("inside")
};

/// A polygon soup as it was read, before any check.
struct PolygonSoup {
    std::vector<Vec3> points;                        ///< [m]
    std::vector<std::vector<std::size_t>> polygons;  ///< indices into points
    /// Texture coordinates (two) and normals of the points, of a file that has some for each; else empty.
    std::vector<Vec3> uvs = {}, normals = {};
};

}  // namespace vdbfrac::tetmesh
