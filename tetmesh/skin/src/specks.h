// Pieces of what is drawn that are too small to be seen, or have no material. Not installed.
#pragma once

#include "skin_topology.h"

#include <vdbfrac/skin/skin_cut.h>
#include <vdbfrac/tetmesh/node_field.h>

namespace vdbfrac::skin {

/// Takes out closed pieces smaller than a voxel that no material is at: what a crack leaves of a skin that bulges out
/// from between its nodes. They would hang in the air. `now`: phi [m]; dx:
/// voxel size [m]. Counts them in `cut`.
void removeSpecks(const SkinTopology& skin, const tetmesh::NodeField<float>& now, double dx, SkinCut& cut);

/// Takes out closed pieces smaller than a quarter of a voxel, which are dust, and those without skin that are smaller
/// than a voxel: what closing its lips has left of a crack inside. Counts them in `cut`.
void removeTiny(const SkinTopology& skin, double dx, SkinCut& cut);

}  // namespace vdbfrac::skin
