// Values on some voxels: what a grid of a file holds that is no level set.
#pragma once

#include <vdbfrac/base/vec.h>

#include <span>
#include <vector>

namespace vdbfrac::grid {

/// Values at voxel coordinates, to be written as a float or a Vec3s grid.
struct VoxelValues {
    std::vector<Coord> coords;
    std::vector<float> scalars;            ///< one a voxel, unless `isVector`
    std::vector<Eigen::Vector3f> vectors;  ///< one a voxel, when `isVector`
    float background = 0;
    bool isVector = false;  ///< says the type of the grid also when it holds nothing
};

/// Scalars at points X [m]: trilinear between the voxels that have one; the background where none of the eight does.
std::vector<float> sample(const VoxelValues& values, double voxelSize, std::span<const Vec3> X);

}  // namespace vdbfrac::grid
