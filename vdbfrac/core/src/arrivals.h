// When cracks came to places, and the frame in which they are first seen. Not installed.
#pragma once

#include <vdbfrac/core/body.h>
#include <vdbfrac/core/stages.h>
#include <vdbfrac/grid/voxel_values.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <variant>
#include <vector>

namespace vdbfrac::core {

/// When cracks came to places X of a body [m, at rest], in seconds; below 0 where none is known to have. Empty for a
/// body without cracks.
inline std::vector<float> arrivalTimes(const Stages& stages, const Body& body, std::span<const Vec3> X)
{
    const auto arrival = stages.sourceOf("arrival");
    if (!arrival) return {};
    const auto values = std::get<grid::VoxelValues>(arrival->source->take(body, arrival->field.name));
    return grid::sample(values, body.phi.voxelSize(), X);
}

/// The first frame, counted from 0, at or after which a crack has come at a time [s]; 0 where none is known to have.
inline std::uint32_t frameOfArrival(float arrival, double fps)
{
    constexpr double kRounding = 1e-3;  // frames: times of arrival are floats
    return std::uint32_t(std::max(0., std::ceil(double(arrival) * fps - kRounding)));
}

}  // namespace vdbfrac::core
