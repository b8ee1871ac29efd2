#include <vdbfrac/core/before_cracks.h>

#include "arrivals.h"

#include <vdbfrac/base/by_voxel.h>
#include <vdbfrac/base/grouping.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>

namespace vdbfrac::core {

namespace {

constexpr double kNear = 0.25;  // voxels: a tet farther away does not carry a point

/// A tet, and how a point lies in it or beside it.
struct In {
    double outside = 0;  // m
    std::uint32_t tet = 0;
    std::array<double, 4> weight{};
};

/// Of each point the nearest tet: where cracks left two that it lies in, the one that was there for longer.
std::vector<std::optional<In>> nearestTets(std::span<const BeforeCracks::Tet> tets,
                                           std::span<const skin::OutsidePoint> points, double dx)
{
    ByVoxel places;
    for (std::uint32_t i = 0; i < points.size(); ++i) places.add(tetmesh::floorOf(points[i].X.array() / dx), i);
    places.sort();
    std::vector<std::optional<In>> nearest(points.size());
    for (std::uint32_t t = 0; t < tets.size(); ++t) {
        Vec3 low = tets[t].X[0], high = low;
        for (const Vec3& X : tets[t].X) low = low.cwiseMin(X), high = high.cwiseMax(X);
        const tetmesh::RestTet rest = tetmesh::restTet({}, tets[t].X);
        places.visit(tetmesh::floorOf(low.array() / dx - kNear), tetmesh::floorOf(high.array() / dx + kNear),
                     [&](std::uint32_t i) {
                         const tetmesh::EmbeddedPoint at = rest.embed(points[i].X);
                         const double out = at.isInTet() ? 0 : rest.outside(at);
                         const double least =
                             nearest[i] ? nearest[i]->outside : std::min(points[i].distance, kNear * dx);
                         if (out < least) nearest[i] = In{out, t, at.weight};
                     });
    }
    return nearest;
}

}  // namespace

BeforeCracks::BeforeCracks(std::span<const Tet> tets, std::span<const skin::OutsidePoint> outside, const Stages& stages,
                           const Body& body, double fps)
{
    constexpr std::uint32_t kNever = std::numeric_limits<std::uint32_t>::max();
    const std::vector<std::optional<In>> nearest = nearestTets(tets, outside, body.phi.voxelSize());
    for (const auto& in : nearest)
        if (in) used_.push_back(in->tet);
    sortUnique(used_);
    std::vector<Vec3> X;
    for (std::size_t i = 0; i < outside.size(); ++i) {
        const skin::OutsidePoint& p = outside[i];
        const auto& in = nearest[i];
        const auto other = in && in->outside == 0 ? std::nullopt : body.mesh->locate(p.X);
        if (!in && !other) continue;
        Point& point = points_.emplace_back(Point{p.point, kNever, {}});
        X.push_back(p.X);
        if (other) {
            point.in = other->point;
            continue;
        }
        const auto number = std::size_t(std::ranges::lower_bound(used_, in->tet) - used_.begin());
        const auto first = std::uint32_t(body.mesh->nodeCount() + 4 * number);
        point.until = tets[in->tet].frame;
        point.in = {{first, first + 1, first + 2, first + 3}, in->weight};
    }
    const std::vector<float> times = arrivalTimes(stages, body, X);
    for (std::size_t i = 0; i < points_.size(); ++i) {
        std::uint32_t& until = points_[i].until;
        if (!times.empty() && times[i] >= 0)
            until = std::min(until, frameOfArrival(times[i], fps));
        else if (until == kNever)
            until = 0;
    }
}

bool BeforeCracks::leave(std::size_t frame, std::span<const std::uint32_t> points)
{
    bool any = false;
    for (const std::uint32_t p : points) {
        const auto at = std::ranges::lower_bound(points_, p, {}, &Point::point);
        if (at == points_.end() || at->point != p || at->until <= frame) continue;
        at->until = std::uint32_t(frame), any = true;
    }
    return any;
}

std::vector<std::uint8_t> BeforeCracks::moves(std::size_t points) const
{
    std::vector<std::uint8_t> moves(points, 0);
    for (const Point& p : points_) moves[p.point] = 1;
    return moves;
}

void BeforeCracks::carry(std::size_t frame, std::span<const Vec3> ofNodes, std::span<Vec3> ofPoints) const
{
    for (const Point& p : points_)
        if (frame < p.until) ofPoints[p.point] = p.in.at(ofNodes);
}

}  // namespace vdbfrac::core
