// What a collider is made of: an exact solid, or the distances round a surface from a file.
#pragma once

#include <vdbfrac/grid/distance_field.h>
#include <vdbfrac/scene/scene.h>

#include <cstdint>
#include <optional>
#include <variant>

namespace vdbfrac::effects {

/// A collider as it is at t = 0.
class Obstacle {
public:
    static constexpr std::uint64_t kFileMemory = std::uint64_t{4} << 30;  ///< bytes that the level set of one may take

    Obstacle(const scene::Collider& collider, const scene::Grid& grid) : collider_(collider)
    {
        if (!std::holds_alternative<Primitive>(collider_.shape)) field_.emplace(collider_, grid, kFileMemory);
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
    std::size_t bytes() const { return field_ ? field_->bytes() : 0; }

private:
    scene::Collider collider_;
    std::optional<grid::DistanceField> field_;
    double thickness_;
};

}  // namespace vdbfrac::effects
