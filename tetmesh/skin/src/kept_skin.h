// What cracks leave of the outer surface, fitted to rims that have moved. Not installed.
#pragma once

#include "skin_topology.h"

#include <vdbfrac/skin/skin_cut.h>

#include <array>
#include <cstdint>
#include <span>

namespace vdbfrac::skin {

/// A rim that is made fair, or closed, passes over corners of fine triangles, and what has these looks inward. Where it
/// does, corners up to two voxels away move as the rim does, the less the farther, over the smooth face that they are
/// on; they become points of the cut. Rims that turn back on themselves are unfolded. dx: voxel size [m]. `made`:
/// points of the cut before rims moved; `given`: triangles of the outer surface, by given points.
void fitKept(const SkinTopology& skin, double dx, std::span<const SkinCut::Point> made,
             std::span<const std::array<std::uint32_t, 3>> given, SkinCut& cut);

}  // namespace vdbfrac::skin
