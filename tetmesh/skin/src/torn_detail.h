// Roughness that a simulation does not resolve, on torn faces. Not installed.
#pragma once

#include "crack_lattice.h"

#include <vdbfrac/skin/skin_cut.h>

namespace vdbfrac::skin {

/// Moves points of torn faces by noise of the place at rest, the same on both lips; none at the outer surface. `rest`:
/// phi [m] at rest.
void addTornDetail(const TornDetail& detail, const tetmesh::NodeField<float>& rest, double dx, SkinCut& cut);

}  // namespace vdbfrac::skin
