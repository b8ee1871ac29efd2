// Parts of triangles divided anew. Not installed.
#pragma once

#include "skin_topology.h"

#include <vdbfrac/skin/skin_cut.h>

#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::skin {

/// Divides parts, sorted by triangle, anew after points of the cut have moved: a division that was good may fold over.
/// What hangs together in a triangle keeps its border; where that crosses itself now it stays as it was.
void redivide(const SkinTopology& skin, std::span<const SkinCut::Point> points, std::vector<SkinCut::Part>& parts);

/// The same with parts of triangles that have points of the cut which moved.
void redivide(const SkinTopology& skin, std::span<const std::uint8_t> isMoved, SkinCut& cut);

}  // namespace vdbfrac::skin
