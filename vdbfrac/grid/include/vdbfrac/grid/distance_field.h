// The distance to a solid that was read from a file, to its middle where that is not too deep.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/scene/scene.h>

#include <cstdint>
#include <memory>

namespace vdbfrac::grid {

struct DistanceSample {
    double value;  ///< m, negative inside
    Vec3 gradient;
};

/// Owner of a level set whose band reaches through the whole inside, or kDeepest voxels deep; below, nothing changes.
class DistanceField {
public:
    /// Voxels inside to which distances are known; what lies deeper is as deep as that.
    static constexpr int kDeepest = 32;

    /// Of a collider that is a mesh or a level set, in the voxels of the scene. Errors as makeLevelSet().
    DistanceField(const scene::Collider& collider, const scene::Grid& grid, std::uint64_t memoryLimit);
    DistanceField(DistanceField&&) noexcept;
    ~DistanceField();

    /// Trilinear between voxels, with the gradient of that. Beyond the band outside that to a box round the solid, or
    /// the band's width without a gradient. May be called from any number of threads.
    DistanceSample at(const Vec3& X) const;
    double deepest() const { return deepest_; }  ///< m inside
    /// Of the surface: the share behind which the solid is less than two voxels thick, as blades are at their edge.
    double thinShare() const;
    double across() const;  ///< m: the longest side of a box round it
    /// Most that the distance changes by over a way, over the length of the way: at least 1.
    double steepest() const { return steepest_; }
    std::size_t bytes() const;

private:
    struct Data;
    std::unique_ptr<Data> data_;
    double deepest_ = 0, steepest_ = 1;
};

}  // namespace vdbfrac::grid
