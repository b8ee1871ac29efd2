// What colliders are made of, exact solids or the distances round surfaces from files, and where they are.
#pragma once

#include <vdbfrac/contact/contact_surface.h>
#include <vdbfrac/grid/distance_field.h>
#include <vdbfrac/scene/placement.h>
#include <vdbfrac/scene/scene.h>

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace vdbfrac::effects {

/// A ball round some points.
struct Ball {
    Vec3 center;
    double radius = 0;  // m

    explicit Ball(std::span<const Vec3> points);
};

/// A collider as it is at t = 0.
class Obstacle {
public:
    Obstacle(const scene::Collider& collider, const scene::Grid& grid) : collider_(collider)
    {
        if (!std::holds_alternative<Primitive>(collider_.shape))
            field_.emplace(collider_, grid, std::numeric_limits<std::uint64_t>::max());
        thickness_ = field_ ? field_->deepest() : vdbfrac::halfThickness(std::get<Primitive>(collider_.shape));
    }
    const scene::Collider& collider() const { return collider_; }
    double halfThickness() const { return thickness_; }  ///< m; infinity: nothing comes through
    double distance(const Vec3& X) const                 ///< m; negative inside
    {
        return field_ ? field_->at(X).value : signedDistance(std::get<Primitive>(collider_.shape), X);
    }
    Vec3 gradient(const Vec3& X) const  ///< of the distance
    {
        return field_ ? field_->at(X).gradient : distanceGradient(std::get<Primitive>(collider_.shape), X);
    }
    /// Most that the distance changes by over a way, over the length of the way.
    double steepest() const { return field_ ? field_->steepest() : 1; }
    /// Nothing in a ball is nearer to it than this [m], where it is at a place.
    double least(const Ball& ball, const scene::Placement& place) const
    {
        return distance(place.inverse(ball.center)) - steepest() * ball.radius;
    }
    /// Does a way lead from A outside through it and to the other side?
    bool isPassed(const Vec3& A, const Vec3& B) const;
    double thinShare() const { return field_ ? field_->thinShare() : 0; }  ///< as DistanceField's; 0 of a solid
    /// m; 0 of a solid.
    double across() const { return field_ ? field_->across() : 0; }
    std::size_t bytes() const { return field_ ? field_->bytes() : 0; }

private:
    scene::Collider collider_;
    std::optional<grid::DistanceField> field_;
    double thickness_;
};

/// Where all colliders are at a time.
using Places = std::vector<scene::Placement>;

/// All colliders of a scene.
class Obstacles {
public:
    explicit Obstacles(const scene::Scene& scene)
    {
        for (const scene::Collider& c : scene.colliders) all_.emplace_back(c, scene.grid);
    }
    std::size_t size() const { return all_.size(); }
    const Obstacle& operator[](std::size_t c) const { return all_[c]; }
    Places placesAt(double time) const
    {
        Places places;
        for (const Obstacle& o : all_) places.push_back(scene::placementAt(o.collider().move, time));
        return places;
    }
    /// Of each collider, just after a time [s].
    std::vector<scene::RigidVelocity> velocitiesAt(double time) const
    {
        std::vector<scene::RigidVelocity> velocities;
        for (const Obstacle& o : all_) velocities.push_back(scene::velocityAt(o.collider().move, time));
        return velocities;
    }
    /// m; of a point y [m] from a collider.
    double distance(const Vec3& y, std::size_t collider, const Places& places) const
    {
        return all_[collider].distance(places[collider].inverse(y));
    }
    /// Where a collider takes what is at y [m] on its way from one place to another.
    Vec3 carry(const Vec3& y, std::size_t collider, const Places& from, const Places& to) const
    {
        return to[collider](from[collider].inverse(y));
    }
    /// m, at most: how far what is in a ball moves as a collider sees it, by the collider's own motion.
    double farthest(const Ball& ball, std::size_t collider, const Places& from, const Places& to) const
    {
        const scene::Placement &a = from[collider], &b = to[collider];
        return (b.inverse(ball.center) - a.inverse(ball.center)).norm() + (b.turn - a.turn).norm() * ball.radius;
    }
    std::size_t bytes() const
    {
        std::size_t sum = 0;
        for (const Obstacle& o : all_) sum += o.bytes();
        return sum;
    }

private:
    std::vector<Obstacle> all_;
};

/// Tells which bodies begin in which colliders.
void noteDepths(const contact::ContactSurface& surface, const core::SolvedStep& now, std::span<const core::Body> bodies,
                const Obstacles& obstacles, std::vector<std::string>& notes);

/// Tells which colliders are too thin to hold what is soft, or so large that a mistake in units is likely.
void noteSizes(const Obstacles& obstacles, double dx, std::vector<std::string>& notes);

}  // namespace vdbfrac::effects
