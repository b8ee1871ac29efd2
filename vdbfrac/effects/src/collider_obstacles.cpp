#include "collider_obstacles.h"

#include <vdbfrac/base/number_text.h>

#include <algorithm>

namespace vdbfrac::effects {

Ball::Ball(std::span<const Vec3> points) : center(Vec3::Zero())
{
    if (points.empty()) return;
    Vec3 lower = points.front(), upper = lower;
    for (const Vec3& y : points) lower = lower.cwiseMin(y), upper = upper.cwiseMax(y);
    center = .5 * (lower + upper);
    for (const Vec3& y : points) radius = std::max(radius, (y - center).squaredNorm());
    radius = std::sqrt(radius);
}

bool Obstacle::isPassed(const Vec3& A, const Vec3& B) const
{
    constexpr int kPlaces = 64;
    const Vec3 way = B - A;
    const double length = way.norm();
    if (!(length > thickness_) || !(distance(A) >= 0) || !(gradient(A).dot(gradient(B)) < 0)) return false;
    // As far at a time as nothing can be in the way (Hart 1996).
    const double least = length / kPlaces;
    for (double gone = 0; gone < length;) {
        const double d = distance(A + gone / length * way);
        if (d < 0) return true;
        gone += std::max(least, d / steepest());
    }
    return false;
}

/// What begins in a collider stays as deep: most often that is a mistake.
void noteDepths(const contact::ContactSurface& surface, const core::SolvedStep& now, std::span<const core::Body> bodies,
                const Obstacles& obstacles, std::vector<std::string>& notes)
{
    constexpr double kTold = .5;  // voxels
    const Places places = obstacles.placesAt(now.time);
    std::vector<double> most(bodies.size() * obstacles.size(), 0);
    for (std::size_t i = 0; i < surface.size(); ++i)
        for (std::size_t c = 0; c < obstacles.size(); ++c) {
            double& depth = most[surface.body(i) * obstacles.size() + c];
            depth = std::max(depth, -obstacles.distance(surface.at(i, now.x), c, places));
        }
    for (std::size_t k = 0; k < most.size(); ++k)
        if (most[k] > kTold * bodies[k / obstacles.size()].mesh->voxelSize())
            notes.push_back("body '" + bodies[k / obstacles.size()].name + "' begins up to " + shortNumber(most[k], 3) +
                            " m deep in collider '" + obstacles[k % obstacles.size()].collider().name +
                            "': it is not pushed out but by untangle_speed");
}

void noteSizes(const Obstacles& obstacles, double dx, std::vector<std::string>& notes)
{
    constexpr double kThin = 2, kLong = 1000;  // voxels
    constexpr double kLess = .95;              // so that two digits are not too many
    constexpr double kMuch = .005;             // of the surface
    for (std::size_t c = 0; c < obstacles.size(); ++c) {
        const std::string own = "collider '" + obstacles[c].collider().name + "' is ";
        if (const double thickness = 2 * obstacles[c].halfThickness(); thickness < kThin * dx)
            notes.push_back(own + shortNumber(thickness, 3) +
                            " m thick, less than two voxels: soft material may pass it; voxels of " +
                            shortNumber(kLess * thickness / kThin, 2) + " m are small enough to hold it back");
        else if (const double thin = obstacles[c].thinShare(); thin > kMuch)
            notes.push_back(own + "less than two voxels thick behind " + shortNumber(100 * thin, 2) +
                            " % of its surface, as a blade is at its edge: soft material may pass it there");
        if (const double across = obstacles[c].across(); across > kLong * dx)
            notes.push_back(own + std::to_string(std::lround(across / dx)) +
                            " voxels across and from a file, which takes long and " +
                            shortNumber(double(obstacles[c].bytes()) / 1e9, 2) +
                            " GB: check its units, or use a solid");
    }
}

}  // namespace vdbfrac::effects
