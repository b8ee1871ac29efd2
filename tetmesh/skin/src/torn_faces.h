// The torn faces: c = 0 where it lies inside the outer surface. Not installed.
#pragma once

#include "crossings.h"

#include <vdbfrac/skin/skin_cut.h>

#include <cstdint>
#include <span>

namespace vdbfrac::skin {

struct TornSource {
    const CrackLattice& lattice;
    const tetmesh::NodeField<float>& rest;  ///< phi [m] at rest
    const Crossings& crossings;             ///< points 0, 1, ... of `cut` from number `firstPoint` on
    std::span<const std::uint8_t> isInner;  ///< of each triangle of the skin: it trims nothing
    double offset = 0;                      ///< m: how far the outer surface lies from that of phi, at most
    std::uint32_t firstPoint = 0;           ///< number of the first point that is not given by the outer surface
};

/// Adds torn faces and their points to a cut whose points are the crossings.
void addTornFaces(const TornSource& source, SkinCut& cut);

}  // namespace vdbfrac::skin
