// Polygons divided into triangles: in a plane, along lines in them, and in space.
#pragma once

#include <vdbfrac/base/vec.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace vdbfrac::tetmesh {

/// The outline is one closed line or several, one in another where there are holes; lines part the polygon into
/// regions, and a region and the one beyond a line have opposite labels.
struct PlanarPolygon {
    std::vector<std::array<double, 2>> points;
    std::vector<std::array<std::uint32_t, 2>> outline;  ///< pairs of points
    std::vector<std::uint8_t> label;                    ///< inside, beside each edge of the outline
    std::vector<std::array<std::uint32_t, 2>> lines;    ///< pairs of points

    /// Closes an outline through points in order; `labels`: from each point to the next.
    void goRound(const std::vector<std::uint32_t>& round, const std::vector<std::uint8_t>& labels);
};

struct PlanarTriangles {
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise
    std::vector<std::uint8_t> label;                      ///< of each
    bool isSound = true;  ///< else lines cross or points coincide, and a part may be missing
};

/// By a constrained Delaunay triangulation.
PlanarTriangles triangulate(const PlanarPolygon& polygon);

/// Two coordinates of points in a plane, which keep its orientation: `normal` looks at the viewer.
std::array<double, 2> flattened(const Vec3& X, const Vec3& normal);

/// A polygon of points in space that have names, each once.
template <class Name>
class NamedPolygon {
public:
    explicit NamedPolygon(const Vec3& normal) : normal_(normal) {}

    /// Number of the point of a name, which lies at X.
    std::uint32_t number(const Name& name, const Vec3& X)
    {
        if (const auto known = find(name)) return *known;
        const auto next = std::uint32_t(names_.size());
        names_.push_back(name);
        if (names_.size() > kFew)
            for (auto n = std::uint32_t(number_.size()); n <= next; ++n) number_.emplace(names_[n], n);
        polygon.points.push_back(flattened(X, normal_));
        return next;
    }
    std::array<Name, 3> names(const std::array<std::uint32_t, 3>& triangle) const
    {
        return {names_[triangle[0]], names_[triangle[1]], names_[triangle[2]]};
    }

    PlanarPolygon polygon;

private:
    static constexpr std::size_t kFew = 32;  // that are looked through faster than they are put into a tree

    std::optional<std::uint32_t> find(const Name& name) const
    {
        if (names_.size() > kFew) {
            const auto at = number_.find(name);
            return at == number_.end() ? std::nullopt : std::optional(at->second);
        }
        const auto at = std::find(names_.begin(), names_.end(), name);
        return at == names_.end() ? std::nullopt : std::optional(std::uint32_t(at - names_.begin()));
    }

    Vec3 normal_;
    std::vector<Name> names_;
    std::map<Name, std::uint32_t> number_;  // of all, where they are many
};

/// Is a polygon in space, seen along its area vector, convex without corners of 180 degrees, so that a fan from its
/// first corner divides it?
bool isConvex(std::span<const Vec3> corners);
/// Triangles of one that is not, as it runs, of numbers of its corners; a fan where it meets itself.
std::vector<std::array<std::uint32_t, 3>> polygonTriangles(std::span<const Vec3> corners);
/// Calls visit(a, b, c) for the triangles of a polygon in space, with numbers of its corners.
template <class Visit>
void eachTriangle(std::span<const Vec3> corners, const Visit& visit)
{
    if (isConvex(corners))
        for (std::uint32_t k = 2; k < corners.size(); ++k) visit(0u, k - 1, k);
    else
        for (const auto& [a, b, c] : polygonTriangles(corners)) visit(a, b, c);
}

/// Things by their places along a line, the last first if it is `turned`.
std::vector<std::uint32_t> inOrder(std::vector<std::pair<double, std::uint32_t>> placed, bool turned);

}  // namespace vdbfrac::tetmesh
