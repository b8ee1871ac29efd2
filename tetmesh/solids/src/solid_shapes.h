// Single solids as triangles. Not installed.
#pragma once

#include <vdbfrac/base/primitive.h>

#include <array>
#include <cstdint>
#include <vector>

namespace vdbfrac::solids {

struct Triangles {
    std::vector<Vec3> points;                             ///< m
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< outward
};

/// A closed surface with edges near `edge` [m]. What has no end ends outside of `within`.
Triangles trianglesOf(const Primitive& solid, double edge, const Bounds& within);

}  // namespace vdbfrac::solids
