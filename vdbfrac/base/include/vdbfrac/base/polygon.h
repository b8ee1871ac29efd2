// Polygons in space, divided into a fan of triangles from their first corner.
#pragma once

#include <vdbfrac/base/vec.h>

#include <Eigen/Geometry>

#include <cstddef>

namespace vdbfrac {

/// Twice the area vector [m^2] of a polygon of n corners, of which at(k) gives the place [m].
template <class At>
Vec3 doubleArea(std::size_t n, const At& at)
{
    Vec3 sum = Vec3::Zero();
    for (std::size_t k = 2; k < n; ++k) sum += (at(k - 1) - at(0)).cross(at(k) - at(0));
    return sum;
}

/// Volume [m^3] between a polygon and the origin; above 0 where the corners run counter-clockwise seen from beyond.
/// Summed over a closed surface its volume: as edges are taken from the first corner, the origin may be far away.
template <class At>
double volumeBelow(std::size_t n, const At& at)
{
    return Vec3(at(0)).dot(doubleArea(n, at)) / 6;
}

}  // namespace vdbfrac
