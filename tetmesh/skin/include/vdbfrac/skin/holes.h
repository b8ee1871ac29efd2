// Holes in the outer surface at rest: where the lips of a crack do not meet, as the material between them is gone.
#pragma once

#include <vdbfrac/tetmesh/render_mesh.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::skin {

struct Hole {
    std::vector<std::uint32_t> rim;  ///< points round it, clockwise as seen from outside: faces beside it run so
    /// Triangles that cover it, of places in `rim`, seen from outside counter-clockwise. None where the rim does not
    /// come round, or has no triangulation.
    std::vector<std::array<std::uint32_t, 3>> cover;
};

/// Of a surface at rest [m] with lips closed; `isJoined`: of each point, does it lie on another lip? dx: voxel size
/// [m]. Holes of less than two voxels round about are none. Covers are by CGAL's triangulate_hole_polyline (Liepa
/// 2003).
std::vector<Hole> holesOf(const tetmesh::DrawnTopology& drawn, std::span<const std::uint8_t> isJoined, double dx);

}  // namespace vdbfrac::skin
