// Tets with shared points: what mesh files hold, and what the Delaunay mesher makes.
#pragma once

#include <vdbfrac/base/vec.h>

#include <array>
#include <cstdint>
#include <vector>

namespace vdbfrac::tetmesh {

/// A conforming mesh of tets: two of them meet in a face, an edge, a point, or not at all.
struct TetMesh {
    std::vector<Vec3> points;                            ///< [m]
    std::vector<std::array<std::uint32_t, 4>> tets;      ///< (p1-p0) x (p2-p0) . (p3-p0) > 0
    std::vector<std::array<std::uint32_t, 3>> boundary;  ///< its surface, counter-clockwise seen from outside
};

}  // namespace vdbfrac::tetmesh
