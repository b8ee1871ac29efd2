// phi near its zero -> a signed distance. Not installed.
#pragma once

#include "body_sources.h"

namespace vdbfrac::grid {

/// Edge of the voxels [m]; the shortest where they are no cubes.
double smallestVoxel(const openvdb::FloatGrid& grid);
inline double voxel(const openvdb::FloatGrid& grid) { return grid.voxelSize()[0]; }

/// A band of distances -> one that reaches `extra` voxels farther on both sides, by fast sweeping; the others keep
/// their values. Throws LimitError, as all here, when `build`'s memory does not suffice.
openvdb::FloatGrid::Ptr widened(const openvdb::FloatGrid& grid, int extra, const Build& build);

/// A band of 3 voxels in which only the zero of the source counts, not its slope: beside it the distance to the zero of
/// a cubic through phi, then fast sweeping.
openvdb::FloatGrid::Ptr sweptBand(const openvdb::FloatGrid& source, const Build& build);

/// The sweeps of LevelSetTracker, as many as carry a distance through the band and a voxel more. Voxels beside the
/// surface are held, since sweeps would shift it a little every time; first, those clearly too steep are set anew.
void polish(openvdb::FloatGrid& grid, int halfWidth);

/// Makes the band `halfWidth` voxels wide: what lies beyond is no longer active, and the background.
void trimBand(openvdb::FloatGrid& grid, double halfWidth);

}  // namespace vdbfrac::grid
