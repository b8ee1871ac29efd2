// The surface of a cut lattice.
#pragma once

#include <vdbfrac/tetmesh/cut_mesh.h>
#include <vdbfrac/tetmesh/embedded_surface.h>

namespace vdbfrac::tetmesh {

/// Closed surface of the material, normals outward.
EmbeddedSurface extractSurface(const CutMesh& mesh);

/// Point of a cell (in voxels from its corner 0) in one tet of one of its elements.
EmbeddedPoint embed(const CutMesh& mesh, const CellElement& element, int tet, const Vec3& local);

}  // namespace vdbfrac::tetmesh
