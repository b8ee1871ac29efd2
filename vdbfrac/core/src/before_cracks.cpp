#include <vdbfrac/core/before_cracks.h>

#include "arrivals.h"

#include <vdbfrac/base/by_voxel.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <algorithm>
#include <limits>
#include <optional>

namespace vdbfrac::core {

namespace {

constexpr double kNear = 0.25;  // voxels: a tet farther away does not carry a point

/// Tets by the voxels that their boxes reach into.
ByVoxel byVoxel(std::span<const BeforeCracks::Tet> tets, double dx)
{
    ByVoxel places;
    for (std::uint32_t t = 0; t < tets.size(); ++t) {
        Vec3 low = tets[t].X[0], high = low;
        for (const Vec3& X : tets[t].X) low = low.cwiseMin(X), high = high.cwiseMax(X);
        forVoxelsOf(tetmesh::floorOf(low.array() / dx - kNear), tetmesh::floorOf(high.array() / dx + kNear),
                    [&](Coord voxel) { places.add(voxel, t); });
    }
    places.sort();
    return places;
}

}  // namespace

BeforeCracks::BeforeCracks(std::span<const Tet> tets, std::span<const skin::OutsidePoint> outside, const Stages& stages,
                           const Body& body, double fps)
{
    constexpr std::uint32_t kNever = std::numeric_limits<std::uint32_t>::max();
    const double dx = body.phi.voxelSize();
    const ByVoxel places = byVoxel(tets, dx);
    const auto firstNode = std::uint32_t(body.mesh->nodeCount());
    std::vector<tetmesh::RestTet> rest;
    for (std::uint32_t t = 0; t < tets.size(); ++t) {
        const std::uint32_t n = firstNode + 4 * t;
        rest.push_back(tetmesh::restTet({n, n + 1, n + 2, n + 3}, tets[t].X));
    }
    std::vector<Vec3> X;
    for (const skin::OutsidePoint& p : outside) {
        double least = std::min(p.distance, kNear * dx);
        std::optional<Point> its;
        const Coord voxel = tetmesh::floorOf(p.X.array() / dx);
        places.visit(voxel, voxel, [&](std::uint32_t t) {  // the last taken first: where cracks left two, it stayed
            const tetmesh::EmbeddedPoint at = rest[t].embed(p.X);
            const double out = at.isInTet() ? 0 : rest[t].outside(at);
            if (out < least) least = out, its = Point{p.point, tets[t].frame, at};
        });
        if (least > 0)
            if (const auto other = body.mesh->locate(p.X)) its = Point{p.point, kNever, other->point};
        if (!its) continue;
        points_.push_back(*its);
        X.push_back(p.X);
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

bool BeforeCracks::carry(std::size_t frame, std::span<const Vec3> ofNodes, std::span<Vec3> ofPoints) const
{
    bool any = false;
    for (const Point& p : points_)
        if (frame < p.until) ofPoints[p.point] = p.in.at(ofNodes), any = true;
    return any;
}

}  // namespace vdbfrac::core
