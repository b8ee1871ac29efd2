// Torn faces and rims made fair: what is left of the voxels is taken off them. Not installed.
#pragma once

#include "skin_topology.h"

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/skin/skin_cut.h>

namespace vdbfrac::skin {

/// Moves the points of a cut: in torn faces to even them, along rims on the smooth face, or the sharp edge, of the
/// outer surface that they are on. The outer surface may have any number of triangles to a voxel.
void fair(const SkinTopology& skin, double dx, SkinCut& cut);

/// For each point of a cut those next to it along torn faces, twice each unless at a rim.
Groups neighboursOf(const SkinCut& cut, std::uint32_t firstPoint);

}  // namespace vdbfrac::skin
