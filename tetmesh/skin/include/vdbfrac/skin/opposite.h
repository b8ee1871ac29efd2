// Which place on the other lip of a crack each point of a torn face is opposite to.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/render_mesh.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::skin {

/// A point of a lip, and the closest place to it on what looks against it: a sum over points.
struct Opposite {
    std::uint32_t point = 0;
    std::array<std::uint32_t, 3> corner{};  ///< of a torn face; of an edge of a rim two of them are one
    Vec3 weight = Vec3::Zero();

    Vec3 at(std::span<const Vec3> values) const
    {
        return weight[0] * values[corner[0]] + weight[1] * values[corner[1]] + weight[2] * values[corner[2]];
    }
};

/// Of all points of torn faces that are on no rim and have another lip within 3/4 of a voxel of size dx [m], rising. X
/// [m]: all points; `torn`: triangles, seen from the crack counter-clockwise; `normal`: at points of a rim that of the
/// outer surface, 0 at others.
std::vector<Opposite> oppositeFaces(std::span<const Vec3> X, std::span<const std::array<std::uint32_t, 3>> torn,
                                    std::span<const Vec3> normal, double dx);
/// The same of points of rims, which are opposite to rims.
std::vector<Opposite> oppositeRims(std::span<const Vec3> X, std::span<const std::array<std::uint32_t, 3>> torn,
                                   std::span<const Vec3> normal, double dx);

/// What of a drawn surface lies on the lip opposite at rest: what has been drawn closed.
struct ClosedLips {
    std::vector<Opposite> faces, rims;
};
ClosedLips closedLips(const tetmesh::DrawnTopology& drawn, double dx);

}  // namespace vdbfrac::skin
