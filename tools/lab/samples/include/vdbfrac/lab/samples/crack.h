// Cracks along planes of nodes.
#pragma once

#include <vdbfrac/lab/samples/block.h>

#include <functional>

namespace vdbfrac::lab {

/// The nodes with one lattice coordinate, as {&Coord::z, 5}.
struct NodePlane {
    int Coord::*axis;
    int at;
};

/// Parts a block along a plane: the cells above get copies of those of its nodes for which `open(node)`. The other
/// nodes of the plane stay shared; those next to open ones are the crack's front.
void openCrack(Block& block, NodePlane plane, const std::function<bool(Coord)>& open);

}  // namespace vdbfrac::lab
