// Cracks drawn without a gap: both lips at the middle of it. Not installed.
#pragma once

#include "crack_lattice.h"
#include "skin_topology.h"

#include <vdbfrac/skin/skin_cut.h>

namespace vdbfrac::skin {

/// Moves the points of a cut. Those of the outer surface stay on it, those of its sharp edges on these.
void closeLips(const SkinTopology& skin, const CrackLattice& lattice, SkinCut& cut);

}  // namespace vdbfrac::skin
