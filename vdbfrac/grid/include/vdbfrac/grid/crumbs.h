// Crumbs of a body at rest: what the voxels are too large to join to it.
#pragma once

#include <vdbfrac/grid/level_set.h>

#include <cstddef>
#include <cstdint>
#include <functional>

namespace vdbfrac::grid {

/// Nodes of a crumb: a cube of two voxels.
inline constexpr std::size_t kMostOfCrumb = 8;

/// Takes out parts of up to kMostOfCrumb voxel nodes that lie within 3 voxels of a larger one: thin ends of a body that
/// come off where it is thinner than a voxel. `isApart`: does a voxel node's part hang together with no other in the
/// mesh either? Returns how many there were. Throws LimitError as sampleNodes.
std::size_t takeOutCrumbs(LevelSet& phi, const std::function<bool(Coord)>& isApart, std::uint64_t memoryLimit);

}  // namespace vdbfrac::grid
