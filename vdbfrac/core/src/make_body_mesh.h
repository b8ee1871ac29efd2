// The mesh that a body is simulated on. Not installed.
#pragma once

#include <vdbfrac/core/body.h>
#include <vdbfrac/scene/scene.h>

#include <cstdint>
#include <string>
#include <vector>

namespace vdbfrac::core {

/// Gives a body with a name and phi its mesh and fragments at rest: the lattice of the scene cut by phi, or a Delaunay
/// mesh that encloses the material, cut by it. Crumbs (grid/crumbs.h) are taken out of phi, and told in `notes`.
/// `spec`: what phi was made of; `nextFragment`: the next id, which is advanced. Throws LimitError when a Delaunay
/// mesh, or the box of the material, would take more than `memoryLimit` [bytes].
void makeBodyMesh(const scene::Grid& grid, const scene::Body& spec, std::uint64_t memoryLimit,
                  std::uint32_t& nextFragment, Body& body, std::vector<std::string>& notes);

}  // namespace vdbfrac::core
