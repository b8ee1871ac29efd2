// The frame in which a crack is first seen. Not installed.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace vdbfrac::core {

/// The first frame, counted from 0, at or after which a crack has come at a time [s]; 0 where none is known to have.
inline std::uint32_t frameOfArrival(float arrival, double fps)
{
    constexpr double kRounding = 1e-3;  // frames: times of arrival are floats
    return std::uint32_t(std::max(0., std::ceil(double(arrival) * fps - kRounding)));
}

}  // namespace vdbfrac::core
