// Where something that moves as a whole is at a time: grips and colliders.
#pragma once

#include <vdbfrac/scene/scene.h>

namespace vdbfrac::scene {

/// x = pivot + turn (X - pivot) + shift.
struct Placement {
    Mat3 turn = Mat3::Identity();
    Vec3 pivot = Vec3::Zero(), shift = Vec3::Zero();  ///< m

    Vec3 operator()(const Vec3& X) const { return pivot + turn * (X - pivot) + shift; }
    Vec3 inverse(const Vec3& x) const { return pivot + turn.transpose() * (x - pivot - shift); }
};

Placement placementAt(const Velocity& move, double time);
Placement placementAt(const Keys& move, double time);
Placement placementAt(const Path& path, double time);

/// How fast [m/s] what began at X [m] moves just after a time [s].
Vec3 velocityAt(const Velocity& move, double time, const Vec3& X);
Vec3 velocityAt(const Keys& move, double time, const Vec3& X);
Vec3 velocityAt(const Path& path, double time, const Vec3& X);

}  // namespace vdbfrac::scene
