#include "collider_drawing.h"

#include <vdbfrac/base/parallel.h>

#include <algorithm>

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

void moveOut(const Obstacles& obstacles, double time, double dx, std::span<Vec3> points, std::span<Vec3> velocity)
{
    constexpr std::size_t kTogether = 128;  // points, looked at as one
    const Places places = obstacles.placesAt(time);
    const std::vector<scene::RigidVelocity> carried = obstacles.velocitiesAt(time);
    const auto moveOne = [&](std::size_t i, std::size_t c) {
        const Vec3 X = places[c].inverse(points[i]);
        const double depth = -obstacles[c].distance(X);
        if (!(depth > 0)) return;
        const Vec3 gradient = places[c].turn * obstacles[c].gradient(X);
        if (!(gradient.norm() > 0)) return;  // deeper than the distances round a surface from a file reach
        const Vec3 outward = gradient.normalized();
        const double share = shareMoved(depth / dx);
        velocity[i] -= share * (velocity[i] - carried[c](points[i])).dot(outward) * outward;
        points[i] += share * depth * outward;
    };
    parallelChunks(points.size(), kTogether, [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = 0; c < obstacles.size(); ++c) {
            if (obstacles[c].least(Ball(points.subspan(begin, end - begin)), places[c]) > 0) continue;
            for (std::size_t i = begin; i < end; ++i) moveOne(i, c);
        }
    });
}

}  // namespace vdbfrac::effects
