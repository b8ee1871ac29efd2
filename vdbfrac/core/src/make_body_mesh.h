// The mesh that a body is simulated on. Not installed.
#pragma once

#include <vdbfrac/grid/level_set.h>
#include <vdbfrac/scene/scene.h>
#include <vdbfrac/tetmesh/body_mesh.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace vdbfrac::core {

/// The lattice of the scene cut by the phi of a body, or a Delaunay mesh that encloses the material, cut by it. Crumbs
/// (grid/crumbs.h) are taken out of phi, and told in `notes`. Throws LimitError when a Delaunay mesh, or the box of the
/// material, would take more than `memoryLimit` [bytes].
std::unique_ptr<tetmesh::BodyMesh> makeBodyMesh(const scene::Grid& grid, const scene::Body& body,
                                                std::uint64_t memoryLimit, grid::LevelSet& phi,
                                                std::vector<std::string>& notes);

}  // namespace vdbfrac::core
