// A collider as it is at t = 0.
#pragma once

#include <vdbfrac/grid/distance_field.h>
#include <vdbfrac/scene/scene.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <variant>

namespace vdbfrac::contact {

/// Its signed distance: in closed form, or as a level set.
class Obstacle {
public:
    static constexpr std::uint64_t kMostBytes = std::uint64_t{4} << 30;  ///< that the level set of one file may take

    Obstacle(const scene::Collider& collider, const scene::Grid& grid) : collider_(collider)
    {
        if (!std::holds_alternative<Primitive>(collider_.shape)) field_.emplace(collider_, grid, kMostBytes);
        thickness_ = field_ ? field_->deepest() : vdbfrac::halfThickness(std::get<Primitive>(collider_.shape));
    }
    const scene::Collider& collider() const { return collider_; }
    double halfThickness() const { return thickness_; }  ///< m; infinity: nothing comes through
    DistanceSample at(const Vec3& X) const
    {
        return field_ ? field_->at(X) : sampleDistance(std::get<Primitive>(collider_.shape), X);
    }
    std::size_t bytes() const { return field_ ? field_->bytes() : 0; }

private:
    scene::Collider collider_;
    std::optional<grid::DistanceField> field_;
    double thickness_;
};

}  // namespace vdbfrac::contact
