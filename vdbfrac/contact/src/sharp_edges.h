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

/// Of each triangle of the cut that lies below the surface, as phi is taken for linear along the edges of tets: the
/// nearest point where the flat faces round it meet; on the face, where only one counts. By rising triangle. Of the
/// points of the cut, `X`: at rest [m]; `isTorn`: on a face that a crack has made, where no triangle has any.
std::vector<EdgePoint> edgePoints(const tetmesh::EmbeddedSurface& cut, std::span<const Vec3> X,
                                  std::span<const std::uint8_t> isTorn, const grid::LevelSet& level);

}  // namespace vdbfrac::contact
