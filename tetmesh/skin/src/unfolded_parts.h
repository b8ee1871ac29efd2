// Parts of the outer surface whose rims turn back on themselves, smoothed out. Not installed.
#pragma once

#include "skin_topology.h"

#include <vdbfrac/skin/skin_cut.h>

#include <cstdint>
#include <span>

namespace vdbfrac::skin {

/// Where parts look inward, points of the cut that they have go to the mean of those beside them, again and again, over
/// the smooth face that they are on: on a rim of those along it, so that it no longer turns back but at the ends of
/// cracks, which are hardly moved. `isFixed`: of points of the cut. dx: voxel size [m].
void unfoldParts(const SkinTopology& skin, double dx, std::span<const std::uint8_t> isFixed, SkinCut& cut);

}  // namespace vdbfrac::skin
