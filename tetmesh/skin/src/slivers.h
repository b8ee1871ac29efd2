// Slivers along the rims of cracks. Not installed.
#pragma once

#include "skin_topology.h"

#include <vdbfrac/skin/skin_cut.h>

namespace vdbfrac::skin {

/// Joins neighbours on a rim that lie close together while the triangle of the outer surface beside them is long: such
/// a sliver turns over as soon as the body is strained, and is seen as a dark spike. What is closed stays closed. dx:
/// voxel size [m]. Points that are left out stay in the list, in no face.
void removeSlivers(const SkinTopology& skin, double dx, SkinCut& cut);

}  // namespace vdbfrac::skin
