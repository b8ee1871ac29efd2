// What the files of this library share of OpenVDB. Not installed.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/grid/level_set.h>

#include <openvdb/openvdb.h>

namespace vdbfrac::grid {

struct LevelSetGrid {
    openvdb::FloatGrid::Ptr grid;
};

/// Registers OpenVDB's types once; call it before anything is read from or written to a file.
void initializeOpenVdb();

/// An empty level set: spacing `voxelSize` [m], no translation, background `halfWidth` voxels.
openvdb::FloatGrid::Ptr makeLevelSetGrid(double voxelSize, double halfWidth);

/// Box of the voxels inside, active or not: a file can hold some that are not of the band. Empty when there are none.
openvdb::CoordBBox materialVoxels(const openvdb::FloatGrid& phi);

/// Hands a grid to its owner.
LevelSet wrap(openvdb::FloatGrid::Ptr grid);

inline openvdb::Coord toVdb(const Coord& c) { return {c.x, c.y, c.z}; }
inline Coord fromVdb(const openvdb::Coord& c) { return {c.x(), c.y(), c.z()}; }

}  // namespace vdbfrac::grid
