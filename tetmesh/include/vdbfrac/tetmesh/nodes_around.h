// The nodes round others.
#pragma once

#include <vdbfrac/base/vec.h>

#include <span>
#include <vector>

namespace vdbfrac::tetmesh {

/// All nodes no farther than `reach` along any axis from one of `nodes`; sorted, each once.
std::vector<Coord> nodesAround(std::span<const Coord> nodes, int reach);

}  // namespace vdbfrac::tetmesh
