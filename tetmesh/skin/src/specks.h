// Specks of the outer surface that cracks have cut off where there is no material. Not installed.
#pragma once

#include "skin_topology.h"

#include <vdbfrac/skin/skin_cut.h>
#include <vdbfrac/tetmesh/node_field.h>

namespace vdbfrac::skin {

/// Takes out closed pieces smaller than a voxel that no material is at: what a crack leaves of a skin that bulges out
/// from between its nodes. They would hang in the air. Those that whole triangles are part of stay. `now`: phi [m]; dx:
/// voxel size [m]. Counts them in `cut`.
void removeSpecks(const SkinTopology& skin, const tetmesh::NodeField<float>& now, double dx, SkinCut& cut);

}  // namespace vdbfrac::skin
