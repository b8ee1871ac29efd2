// A closed triangle surface as a level set that remembers its triangles. Not installed.
#pragma once

#include <vdbfrac/tetmesh/surface.h>

#include <openvdb/openvdb.h>

namespace vdbfrac::grid {

/// Level set of a surface, and the number of the closest triangle at each voxel of the band.
struct SurfaceSolid {
    openvdb::FloatGrid::Ptr phi;
    openvdb::Int32Grid::Ptr closest;
};

/// Throws Error on coordinates that are not finite or too large for the voxel size [m], and on indices out of range:
/// tools::meshToVolume would crash on them.
SurfaceSolid makeSurfaceSolid(const tetmesh::Surface& surface, double voxelSize);

}  // namespace vdbfrac::grid
