// Where faces of a body meet in edges that the cut takes off. Not installed.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/grid/level_set.h>
#include <vdbfrac/tetmesh/embedded_surface.h>

#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::contact {

/// A point of a sharp edge, or a corner, that the cut has a triangle for.
struct EdgePoint {
    std::uint32_t triangle = 0;
    Vec3 at;  ///< at rest [m]
};

/// Of each triangle of the cut that lies below the surface, because phi is taken for linear along the edges of tets
/// where two or three flat faces meet: where those meet. By rising triangle. `X`: of the points of the cut at rest [m].
std::vector<EdgePoint> edgePoints(const tetmesh::EmbeddedSurface& cut, std::span<const Vec3> X,
                                  const grid::LevelSet& phi);

}  // namespace vdbfrac::contact
