// A surface embedded in elements: it moves with their nodes.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/surface.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::tetmesh {

/// A point of a tet: sum of weight * x[node].
struct EmbeddedPoint {
    std::array<std::uint32_t, 4> node{};
    std::array<double, 4> weight{};

    Vec3 at(std::span<const Vec3> x) const
    {
        Vec3 p = Vec3::Zero();
        for (std::size_t a = 0; a < 4; ++a) p += weight[a] * x[node[a]];
        return p;
    }
    double leastWeight() const { return *std::min_element(weight.begin(), weight.end()); }  ///< below 0 outside
    bool isInTet() const { return leastWeight() >= -1e-9; }                                 ///< or on a face of it
};

/// A tet at rest, ready for points to be placed in it.
struct RestTet {
    std::array<std::uint32_t, 4> node{};
    Vec3 origin = Vec3::Zero();   ///< m: of the first node
    Mat3 inverse = Mat3::Zero();  ///< of the edges from there to the others

    /// A point [m], in the tet or not.
    EmbeddedPoint embed(const Vec3& X) const
    {
        const Vec3 w = inverse * (X - origin);
        return {node, {1 - w.sum(), w[0], w[1], w[2]}};
    }
    /// How far outside of the plane of a face, at most, a point of embed() lies [m]; 0 in the tet.
    double outside(const EmbeddedPoint& point) const
    {
        double most = 0;
        for (std::size_t a = 0; a < 4; ++a) most = std::max(most, -point.weight[a] / gradient(a).norm());
        return most;
    }
    /// Of the weight of a node in embed() by the place [1/m].
    Vec3 gradient(std::size_t a) const
    {
        return a > 0 ? Vec3(inverse.row(int(a) - 1)) : Vec3(-inverse.colwise().sum());
    }
};

/// A tet of nodes at X [m].
RestTet restTet(const std::array<std::uint32_t, 4>& node, const std::array<Vec3, 4>& X);

/// Closed surface of the material, normals outward. Vertices are shared along every edge the cut crosses.
struct EmbeddedSurface {
    std::vector<EmbeddedPoint> points;
    std::vector<std::uint64_t> key;  ///< of each point: names the edge it lies on, the same in all cuts of the body
    std::vector<std::array<std::uint32_t, 3>> triangles;
    std::vector<std::uint8_t> torn;  ///< of each triangle: most of it lies where material was at rest
    double cutArea = 0;              ///< area in the rest configuration [m^2]
};

/// The surface in the configuration x [m]; `fragmentOfNode` gives each triangle its fragment.
Surface deform(const EmbeddedSurface& surface, std::span<const Vec3> x, std::span<const std::uint32_t> fragmentOfNode);

}  // namespace vdbfrac::tetmesh
