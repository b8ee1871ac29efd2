// Crumbs of a body at rest: what the voxels are too large to join to it.
#pragma once

#include <vdbfrac/grid/level_set.h>
#include <vdbfrac/tetmesh/node_field.h>

#include <cstddef>
#include <functional>

namespace vdbfrac::grid {

/// Nodes of a crumb: a cube of two voxels.
inline constexpr std::size_t kMostOfCrumb = 8;

/// Takes out parts of up to kMostOfCrumb voxel nodes that lie within 3 voxels of a larger one: thin ends of a body that
/// come off where it is thinner than a voxel. `nodes`: phi, as sampleNodes has it. `isApart`: does a voxel node's part
/// hang together with no other in the mesh either? Returns how many there were.
std::size_t takeOutCrumbs(LevelSet& phi, const tetmesh::NodeField<float>& nodes,
                          const std::function<bool(Coord)>& isApart);

}  // namespace vdbfrac::grid
