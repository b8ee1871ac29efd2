// What cracks have taken of the outer surface, fitted between lips that are closed. Not installed.
#pragma once

#include "skin_topology.h"

#include <vdbfrac/skin/skin_cut.h>

#include <span>

namespace vdbfrac::skin {

/// Gives points between rims copies among those of the cut, which belong to the side of the rim that is nearest. dx:
/// voxel size [m]. `made`: the points of the cut before lips were closed, none where they are not: the copies move as
/// the rims round them did, over the smooth face of the outer surface that they are on. What looks inward then is left
/// out: where a surface folds over, two more parts lie there that look outward.
void fitTaken(const SkinTopology& skin, double dx, std::span<const SkinCut::Point> made, SkinCut& cut);

}  // namespace vdbfrac::skin
