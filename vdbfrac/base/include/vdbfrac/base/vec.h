// Small vectors and matrices (Eigen) and integer grid coordinates.
#pragma once

#include <Eigen/Core>

#include <compare>
#include <cstddef>
#include <cstdint>

namespace vdbfrac {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

/// Integer coordinates of a voxel or lattice node; ordered by z, then y, then x.
struct Coord {
    int x = 0, y = 0, z = 0;

    friend bool operator==(const Coord&, const Coord&) = default;
    friend std::strong_ordering operator<=>(const Coord& a, const Coord& b)
    {
        if (auto c = a.z <=> b.z; c != 0) return c;
        if (auto c = a.y <=> b.y; c != 0) return c;
        return a.x <=> b.x;
    }
    friend Coord operator+(const Coord& a, const Coord& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    friend Coord operator-(const Coord& a, const Coord& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend Coord operator*(int s, const Coord& a) { return {s * a.x, s * a.y, s * a.z}; }
    Vec3 toVec() const { return Vec3(x, y, z); }
};

/// phi [m] at a voxel node.
struct VoxelPhi {
    Coord voxel;
    float phi = 0;
    friend bool operator==(const VoxelPhi&, const VoxelPhi&) = default;
};

/// a / m, rounded down also below 0; m > 0, and mostly 1.
inline int floorDiv(int a, int m)
{
    if (m == 1) return a;
    return a >= 0 ? a / m : -((m - 1 - a) / m);
}

}  // namespace vdbfrac
