// The cracks of a body alone, apart from its outer surface.
//
// phi is the distance to the surface of what is left, skin and cracks together. c is the distance to the cracks: phi
// where it was raised, carried on to the skin and through it, so that what is drawn can be cut cleanly.
#pragma once

#include <vdbfrac/tetmesh/node_field.h>

namespace vdbfrac::skin {

/// c [m] on voxel nodes: above 0 where a crack has taken the material, below elsewhere, -3 voxels where no crack is
/// near. `rest` and `now`: phi [m] at the start and at present, on the same box; dx: voxel size [m]. A node that has
/// material keeps c < 0, one that was torn has c > 0, and no |c| is below kLeast voxels.
tetmesh::NodeField<float> crackField(const tetmesh::NodeField<float>& rest, const tetmesh::NodeField<float>& now,
                                     double dx);

/// In voxels. Keeps crossings apart from the nodes.
inline constexpr double kLeast = 1e-3;

}  // namespace vdbfrac::skin
