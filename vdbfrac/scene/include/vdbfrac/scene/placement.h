// Where something that moves as a whole is at a time: grips and colliders.
#pragma once

#include <vdbfrac/scene/scene.h>

#include <Eigen/Geometry>

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

/// How fast what is at x [m] is carried along: velocity + spin x (x - about) [m/s].
struct RigidVelocity {
    Vec3 velocity = Vec3::Zero(), spin = Vec3::Zero(), about = Vec3::Zero();  ///< m/s, 1/s, m

    Vec3 operator()(const Vec3& x) const { return velocity + spin.cross(x - about); }
};

/// Just after a time [s].
RigidVelocity velocityAt(const Velocity& move, double time);
RigidVelocity velocityAt(const Keys& move, double time);
RigidVelocity velocityAt(const Path& path, double time);

}  // namespace vdbfrac::scene
