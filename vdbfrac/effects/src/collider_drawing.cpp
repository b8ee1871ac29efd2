#include "collider_drawing.h"

#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <optional>
#include <vector>

namespace vdbfrac::effects {

namespace {

/// Points and their velocities against colliders, at one time.
class MovingOut {
public:
    MovingOut(const Obstacles& obstacles, double time, double dx)
        : obstacles_(obstacles), dx_(dx), places_(obstacles.placesAt(time)), carried_(obstacles.velocitiesAt(time))
    {
    }

    /// Colliders that points in a ball may be in, or get into as they are moved.
    std::vector<std::size_t> near(const Ball& ball) const
    {
        std::vector<std::size_t> near;
        for (std::size_t c = 0; c < obstacles_.size(); ++c)
            if (obstacles_[c].least(ball, places_[c]) <= kDeepest * dx_) near.push_back(c);
        return near;
    }

    /// Moves a point out of some colliders, one after the other until it is in none: the way out of one may lead into
    /// the next, and distances round a surface from a file are not exact. Was it moved?
    bool move(const std::vector<std::size_t>& near, Vec3& point, Vec3& velocity) const
    {
        constexpr int kRounds = 16;  // in a groove of 60 degrees each leaves a quarter
        bool isMoved = false, isInOne = true, isDeep = false;
        for (int round = 0; round < kRounds && isInOne && !isDeep; ++round) {
            isInOne = false;
            for (const std::size_t c : near) {
                const std::optional<double> share = moveOutOf(c, point, velocity);
                if (!share) continue;
                isInOne = true;
                isMoved = isMoved || *share > 0;
                isDeep = isDeep || *share < 1;  // what is left of its way is to be left
            }
        }
        return isMoved;
    }

private:
    static constexpr double kDeepest = 2;      // voxels that points are moved all the way to the surface
    static constexpr double kTouching = 1e-9;  // voxels

    /// The share of its way to the surface by which it was moved; none where it is not inside.
    std::optional<double> moveOutOf(std::size_t c, Vec3& point, Vec3& velocity) const
    {
        const Obstacle& obstacle = obstacles_[c];
        const Vec3 X = places_[c].inverse(point);
        const double depth = -obstacle.distance(X);
        if (!(depth > kTouching * dx_)) return {};
        const Vec3 gradient = places_[c].turn * obstacle.gradient(X);
        if (!(gradient.norm() > 0)) return {};  // deeper than the distances round a surface from a file reach
        const Vec3 outward = gradient.normalized();
        const double share = shareMoved(depth, obstacle.halfThickness());
        velocity -= share * (velocity - carried_[c](point)).dot(outward) * outward;
        point += share * depth * outward;
        return share;
    }

    /// What is far inside has passed through, and would smear over the surface. Deeper points stay deeper, and in the
    /// middle of what is thin none is moved: on its other side the way out is another.
    double shareMoved(double depth, double halfThickness) const
    {
        const double all = std::min(kDeepest * dx_, halfThickness / 2), none = 2 * all;
        return std::clamp((none - depth) / (none - all), 0., 1.);
    }

    const Obstacles& obstacles_;
    double dx_;  // m
    Places places_;
    std::vector<scene::RigidVelocity> carried_;
};

}  // namespace

void moveOut(const Obstacles& obstacles, double time, double dx, core::DrawnSurface& surface)
{
    constexpr std::size_t kTogether = 128;  // points, looked at as one
    const MovingOut out(obstacles, time, dx);
    parallelChunks(surface.used.size(), kTogether, [&](std::size_t begin, std::size_t end) {
        std::vector<Vec3> some;
        for (std::size_t i = begin; i < end; ++i) some.push_back(surface.points[surface.used[i]]);
        const std::vector<std::size_t> near = out.near(Ball(some));
        if (near.empty()) return;
        for (std::size_t i = begin; i < end; ++i) {
            const std::uint32_t p = surface.used[i];
            if (out.move(near, surface.points[p], surface.velocity[p])) surface.isMoved[p] = 1;
        }
    });
}

}  // namespace vdbfrac::effects
