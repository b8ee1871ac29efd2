// Cracks drawn without a gap: both lips at the middle of it. Not installed.
#pragma once

#include "crack_lattice.h"
#include "skin_topology.h"

#include <vdbfrac/skin/skin_cut.h>

namespace vdbfrac::skin {

/// Moves the points of a cut. Those of the outer surface stay on it, those of its sharp edges on these. `triangles`: of
/// the outer surface, by points as they were given.
void closeLips(const SkinTopology& skin, const CrackLattice& lattice,
               std::span<const std::array<std::uint32_t, 3>> triangles, SkinCut& cut);

}  // namespace vdbfrac::skin
