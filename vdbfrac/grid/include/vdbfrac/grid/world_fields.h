// Fields of the deformed material in world space.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/grid/level_set.h>
#include <vdbfrac/grid/vdb_file.h>
#include <vdbfrac/tetmesh/surface.h>

#include <span>

namespace vdbfrac::grid {

/// Narrow band round the deformed surface, with what its closest point carries.
struct WorldFields {
    LevelSet surface;      ///< m
    VoxelValues velocity;  ///< m/s, on the band
    VoxelValues fragment;  ///< id as a float: some readers know no integer grids
};

/// `pointVelocity`: one a surface point. Throws Error on a surface with values that are not finite.
WorldFields worldFields(const tetmesh::Surface& surface, std::span<const Vec3> pointVelocity, double voxelSize);

}  // namespace vdbfrac::grid
