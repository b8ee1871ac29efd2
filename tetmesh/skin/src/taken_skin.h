// What cracks have taken of the outer surface, fitted between lips that are closed. Not installed.
#pragma once

#include "skin_topology.h"

#include <vdbfrac/skin/skin_cut.h>

#include <array>
#include <cstdint>
#include <span>

namespace vdbfrac::skin {

/// Completes SkinCut::taken. `triangles`: of points as given; `made`: the points of the cut before lips were closed.
/// Points between rims get copies among those of the cut, which belong to the side of the rim that is nearest; they
/// move as the rims round them did, over the smooth face of the outer surface that they are on. What looks inward then
/// is left out: where a surface folds over, two more parts lie there that look outward.
void fitTaken(const SkinTopology& skin, std::span<const std::array<std::uint32_t, 3>> triangles,
              std::span<const SkinCut::Point> made, SkinCut& cut);

}  // namespace vdbfrac::skin
