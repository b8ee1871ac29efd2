// The nearest of some triangles of a surface, and on which of its sides a point is.
#pragma once

#include <vdbfrac/base/triangle.h>
#include <vdbfrac/base/vec.h>

#include <Eigen/Geometry>

#include <array>
#include <cmath>

namespace vdbfrac {

/// Round the corners of a triangle.
inline Eigen::AlignedBox3d triangleBox(const std::array<Vec3, 3>& corners)
{
    return Eigen::AlignedBox3d(corners[0]).extend(corners[1]).extend(corners[2]);
}

class NearestTriangle {
public:
    /// To X; `within`: what is farther is not seen.
    NearestTriangle(const Vec3& X, double within) : X_(X), square_(within * within) {}

    void see(const std::array<Vec3, 3>& corners, const Eigen::AlignedBox3d& box, const Vec3& normal)
    {
        constexpr double kSame = 1e-9;  // relative: at an edge the triangles on both sides are as near
        if (box.squaredExteriorDistance(X_) > square_ * (1 + kSame)) return;
        const Vec3 at = closestPoint(corners, X_).at;
        const double square = (at - X_).squaredNorm(), out = (X_ - at).dot(normal);
        if (square > square_ * (1 + kSame)) return;
        if (square < square_ * (1 - kSame)) most_ = 0;
        if (std::abs(out) >= most_) most_ = std::abs(out), isOutside_ = out > 0, normal_ = normal;
        if (square < square_) square_ = square, at_ = at, isSeen_ = true;
    }

    bool isSeen() const { return isSeen_; }
    const Vec3& at() const { return at_; }          ///< the nearest point of those seen
    const Vec3& normal() const { return normal_; }  ///< there; of an edge, that of the side that X is farther off
    bool isOutside() const { return isOutside_; }   ///< X, of the surface there

private:
    Vec3 X_, at_ = Vec3::Zero(), normal_ = Vec3::Zero();
    double square_, most_ = 0;
    bool isSeen_ = false, isOutside_ = false;
};

}  // namespace vdbfrac
