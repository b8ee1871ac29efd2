// The outer surface as triangles that share corners and edges. Not installed.
#pragma once

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/vec.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::skin {

/// Least cosine of the angle between triangles of one smooth face, and between pieces of one sharp edge.
inline constexpr double kSameFace = 0.87;

struct SkinTopology {
    std::vector<Vec3> points;                             ///< m; each place once
    std::vector<std::uint32_t> pointOf;                   ///< of each point that was given: its place
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices into points
    std::vector<std::array<std::uint32_t, 3>> edgeOf;     ///< of each triangle: edge k goes from corner k to the next
    std::vector<std::array<std::uint32_t, 2>> edges;      ///< the lower point first
    std::vector<Vec3> normal, edgeNormal;                 ///< of each triangle; of each edge: of its first triangle
    Groups trianglesOf;                                   ///< those of each edge
    std::vector<bool> isSharp;                            ///< of each edge: its triangles are no one smooth face

    /// Direction of an edge.
    Vec3 along(std::size_t edge) const { return (points[edges[edge][1]] - points[edges[edge][0]]).stableNormalized(); }
    /// Of a triangle [m].
    std::array<Vec3, 3> corners(std::size_t triangle) const
    {
        const auto& c = triangles[triangle];
        return {points[c[0]], points[c[1]], points[c[2]]};
    }
};

/// Joins points with equal coordinates.
SkinTopology topologyOf(std::span<const Vec3> points, std::span<const std::array<std::uint32_t, 3>> triangles);

}  // namespace vdbfrac::skin
