// Parts of a body that are apart at rest, though one skin is round them. Not installed.
#pragma once

#include <vdbfrac/tetmesh/node_field.h>

#include <vector>

namespace vdbfrac::skin {

/// Nodes without material halfway between such parts, where they are so near to each other that one skin may be round
/// both: that of a part thinner than voxels see. `rest`: phi [m]; dx: voxel size [m]. Rising.
std::vector<Coord> nodesBetweenParts(const tetmesh::NodeField<float>& rest, double dx);

}  // namespace vdbfrac::skin
