// What a level set encloses, and its surface as triangles.
#pragma once

#include <vdbfrac/grid/level_set.h>
#include <vdbfrac/tetmesh/surface.h>

namespace vdbfrac::grid {

/// Volume where the trilinear phi is below 0 [m^3], by 4^2 lines in each cell of voxels that the surface crosses.
/// (tools::levelSetVolume smears the surface over three voxels: where parts are a few voxels thin it is off by
/// percents.)
double enclosedVolume(const LevelSet& phi);

/// The surface phi = 0 by tools::volumeToMesh, normals outward. `adaptivity` in [0, 1]: how readily flat parts become
/// larger triangles; 0 keeps the polygons of every voxel. Each connected part is a fragment, the part with most
/// triangles is 0; no triangle is torn.
tetmesh::Surface surfaceOf(const LevelSet& phi, double adaptivity);

}  // namespace vdbfrac::grid
