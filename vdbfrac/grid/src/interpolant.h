// phi between voxels, and the distance to its zero. Not installed.
#pragma once

#include "openvdb_access.h"

#include <array>

namespace vdbfrac::grid {

/// Cubic Lagrange interpolation of phi over the 4^3 voxels round a point: fourth order, and exact at voxels. For one
/// thread: it remembers the values round the last point.
class Interpolant {
public:
    explicit Interpolant(const openvdb::FloatGrid& grid) : values_(grid.getConstAccessor()) {}

    struct Sample {
        double value;   ///< [m]
        Vec3 gradient;  ///< [m] a voxel
    };
    /// `point` in voxels.
    Sample at(const Vec3& point);
    double valueAt(const Vec3& point) { return at(point).value; }

private:
    void gather(const openvdb::Coord& lower);

    openvdb::FloatGrid::ConstAccessor values_;
    openvdb::Coord lower_ = openvdb::Coord::max();
    std::array<double, 64> around_{};
};

/// Distance [voxels] of a voxel beside the surface to the zero of phi, by Newton's method on the cubic (Chopp 2001), or
/// that to the nearest crossing on an edge to one of its 26 neighbours where Newton's finds none so near. At least one
/// of them has the other sign.
double distanceToZero(const openvdb::FloatGrid::ConstAccessor& values, Interpolant& phi, const openvdb::Coord& voxel);

}  // namespace vdbfrac::grid
