// The mesh that a body is simulated on. Not installed.
#pragma once

#include <vdbfrac/grid/level_set.h>
#include <vdbfrac/scene/scene.h>
#include <vdbfrac/tetmesh/body_mesh.h>

#include <cstdint>
#include <memory>

namespace vdbfrac::core {

/// The lattice of the scene cut by phi, or a Delaunay mesh that encloses the material, cut by it. Throws LimitError
/// when a Delaunay mesh, or the box of the material, would take more than `memoryLimit` [bytes].
/// `shape`: what phi is of.
std::unique_ptr<tetmesh::BodyMesh> makeBodyMesh(const scene::Grid& grid, const grid::LevelSet& phi,
                                                const tetmesh::RestShape& shape, std::uint64_t memoryLimit);

}  // namespace vdbfrac::core
