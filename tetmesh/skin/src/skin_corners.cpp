#include "skin_corners.h"

#include <vdbfrac/base/triangle.h>

#include <algorithm>
#include <limits>

namespace vdbfrac::skin {

using tetmesh::RenderMesh;

RenderMesh::Corner SkinCorners::at(std::uint32_t triangle, std::uint32_t point)
{
    if (triangle != triangle_) triangle_ = triangle, made_.clear();
    for (std::size_t k = 0; k < 3; ++k)
        if (corner(triangle, k).point == point) return corner(triangle, k);
    for (const Corner& c : made_)
        if (c.point == point) return c;
    const SkinCut::Point& at = points_[point - given_.points.size()];
    Corner made{point, between(triangle, at, &RenderMesh::uvs, &Corner::uv),
                between(triangle, at, &RenderMesh::normals, &Corner::normal)};
    if (made.normal != RenderMesh::kNone) drawn_.normals.back().normalize();
    return made_.emplace_back(made);
}

/// Adds the value for a point to what is drawn; none where the triangle has none.
std::uint32_t SkinCorners::between(std::uint32_t triangle, const SkinCut::Point& point, Values values,
                                   Number number) const
{
    for (std::size_t k = 0; k < 3; ++k)
        if (corner(triangle, k).*number == RenderMesh::kNone) return RenderMesh::kNone;
    const Place place = point.on == triangle ? Place{triangle, sharesOf(skin_.corners(triangle), point.X)}
                                             : nearest(triangle, point.X, values, number);
    Vec3 value = Vec3::Zero();
    for (std::size_t k = 0; k < 3; ++k)
        value += place.shares[int(k)] * (given_.*values)[corner(place.triangle, k).*number];
    (drawn_.*values).push_back(value);
    return std::uint32_t((drawn_.*values).size() - 1);
}

/// From triangle to triangle, as long as they are as near to X as what was found.
SkinCorners::Place SkinCorners::nearest(std::uint32_t triangle, const Vec3& X, Values values, Number number) const
{
    double least = std::numeric_limits<double>::infinity();
    Place best;
    std::vector<std::uint32_t> reached{triangle};
    for (std::size_t i = 0; i < reached.size(); ++i) {
        const std::uint32_t t = reached[i];
        const Vec3 at = closestPoint(skin_.corners(t), X).at;
        const double d = (at - X).squaredNorm();
        if (d > least) continue;
        if (d < least) least = d, best = {t, sharesOf(skin_.corners(t), at)};
        for (const std::uint32_t e : skin_.edgeOf[t])
            for (const std::uint32_t beside : skin_.trianglesOf[e])
                if (std::ranges::find(reached, beside) == reached.end() && !isSeam(e, t, beside, values, number))
                    reached.push_back(beside);
    }
    return best;
}

/// Do the triangles a and b have different values at the ends of the edge that they share?
bool SkinCorners::isSeam(std::uint32_t edge, std::uint32_t a, std::uint32_t b, Values values, Number number) const
{
    const auto at = [&](std::uint32_t triangle, std::uint32_t end) {
        const auto& t = skin_.triangles[triangle];
        return corner(triangle, std::size_t(std::ranges::find(t, end) - t.begin())).*number;
    };
    return std::ranges::any_of(skin_.edges[edge], [&](std::uint32_t end) {
        const std::uint32_t p = at(a, end), q = at(b, end);
        return p == RenderMesh::kNone || q == RenderMesh::kNone || (given_.*values)[p] != (given_.*values)[q];
    });
}

}  // namespace vdbfrac::skin
