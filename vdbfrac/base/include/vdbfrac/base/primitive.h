// Analytic solids and their signed distance. A body is built from them, a grip holds what lies in one.
#pragma once

#include <vdbfrac/base/vec.h>

namespace vdbfrac {

/// A solid in world space [m]. Only the members its kind names are read.
struct Primitive {
    enum class Kind {
        box,        ///< center, size (edge lengths), rotate
        sphere,     ///< center, radius
        cylinder,   ///< center, axis, radius, height (0: endless)
        capsule,    ///< center, axis, radius, height (between the centers of its two caps)
        torus,      ///< center, axis, radius (of the ring), tube
        halfspace,  ///< normal, offset: all X with normal.X >= offset
    };
    Kind kind = Kind::box;
    Vec3 center = Vec3::Zero();
    Vec3 size = Vec3::Ones();
    Vec3 rotate = Vec3::Zero();  ///< degrees about x, then y, then z; about the center
    Vec3 axis = Vec3::UnitY();   ///< unit length; the normal of a halfspace
    double radius = 0;
    double height = 0;
    double tube = 0;
    double offset = 0;
};

/// Signed distance [m] of X to the surface, negative inside. Exact for every kind.
double signedDistance(const Primitive& solid, const Vec3& X);

/// The direction in which it grows fastest, of unit length; some such direction where there are several.
Vec3 distanceGradient(const Primitive& solid, const Vec3& X);

/// How deep [m] a point can be inside, at least: infinity in a halfspace.
double halfThickness(const Primitive& solid);

/// Axis-aligned bounds; a halfspace or an endless cylinder reaches to +-infinity.
struct Bounds {
    Vec3 lower, upper;
};
Bounds bounds(const Primitive& solid);

}  // namespace vdbfrac
