// Triangles in space.
#pragma once

#include <vdbfrac/base/vec.h>

#include <array>

namespace vdbfrac {

/// The point of a triangle that is closest to another, and the part of the triangle it lies on.
struct ClosestPoint {
    enum class On { face, edge, corner };
    Vec3 at;
    On on = On::face;
    int number = 0;  ///< of the corner, or of the edge from this corner to the next
};
/// Ericson 2005, Real-Time Collision Detection, 5.1.5.
ClosestPoint closestPoint(const std::array<Vec3, 3>& corners, const Vec3& X);

/// Shares of a triangle's corners in a point of it. Of one without area, those of the ends of an edge.
Vec3 sharesOf(const std::array<Vec3, 3>& corners, const Vec3& X);

}  // namespace vdbfrac
