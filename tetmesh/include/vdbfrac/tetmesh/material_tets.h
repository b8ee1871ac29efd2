// A cut mesh as tets with shared points, for mesh files.
#pragma once

#include <vdbfrac/tetmesh/cut_mesh.h>
#include <vdbfrac/tetmesh/tet_mesh.h>

#include <vector>

namespace vdbfrac::tetmesh {

/// The tets of the simulation as they are, whole: they reach beyond the surface. Material that is apart has points of
/// its own, so tets of different fragments may lie in the same place.
struct WholeTets {
    TetMesh mesh;
    std::vector<double> fraction;  ///< of each tet: material volume / tet volume, in (0, 1]
};
WholeTets wholeTets(const CutMesh& cut);

/// The material parts of the tets, divided into tets, so that the boundary is the surface: a closed 2-manifold. Parts
/// of neighbours meet in the same triangles, because each side that two of them share is divided from its lowest point
/// (Dompierre et al. 1999). All tets have a volume above 0; those at the surface may be as thin as kSnap.
/// The volume is CutMesh::volume() to rounding; a node with phi = 0 is taken to lie kSnap dx outside.
TetMesh materialTets(const CutMesh& cut);

}  // namespace vdbfrac::tetmesh
