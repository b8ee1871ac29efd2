#include "collider_drawing.h"

#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <array>

namespace vdbfrac::effects {

namespace {

/// Of the way to the surface, which a point at some depth [voxels] is moved. What is far inside has passed through, and
/// would smear over the surface. Deeper points stay deeper.
double shareMoved(double depth)
{
    constexpr double kAll = 2, kNone = 4;
    return std::clamp((kNone - depth) / (kNone - kAll), 0., 1.);
}

}  // namespace

std::int64_t moveOut(const Obstacles& obstacles, double time, double dx, std::span<Vec3> points,
                     std::span<Vec3> velocity)
{
    constexpr std::size_t kTogether = 128;  // points, looked at as one
    const Places places = obstacles.placesAt(time);
    const std::vector<scene::RigidVelocity> carried = obstacles.velocitiesAt(time);
    const auto moveOne = [&](std::size_t i, std::size_t c) {
        const Vec3 X = places[c].inverse(points[i]);
        const double depth = -obstacles[c].distance(X);
        if (!(depth > 0)) return false;
        const Vec3 gradient = places[c].turn * obstacles[c].gradient(X);
        if (!(gradient.norm() > 0)) return false;  // deeper than the distances round a surface from a file reach
        const Vec3 outward = gradient.normalized();
        const double share = shareMoved(depth / dx);
        velocity[i] -= share * (velocity[i] - carried[c](points[i])).dot(outward) * outward;
        points[i] += share * depth * outward;
        return share > 0;
    };
    return std::int64_t(orderedSum(points.size(), kTogether, [&](std::size_t begin, std::size_t end) {
        std::array<bool, kTogether> isMoved{};
        for (std::size_t c = 0; c < obstacles.size(); ++c) {
            if (obstacles[c].least(Ball(points.subspan(begin, end - begin)), places[c]) > 0) continue;
            for (std::size_t i = begin; i < end; ++i) isMoved[i - begin] |= moveOne(i, c);
        }
        return double(std::ranges::count(isMoved, true));
    }));
}

}  // namespace vdbfrac::effects
