// A body of the scene -> its narrow-band phi.
#pragma once

#include <vdbfrac/grid/level_set.h>
#include <vdbfrac/scene/scene.h>
#include <vdbfrac/tetmesh/body_mesh.h>

#include <cstdint>
#include <string>
#include <vector>

namespace vdbfrac::grid {

/// Builds phi of a body: an analytic shape sampled exactly, a closed mesh through tools::meshToVolume, or a level set
/// read from a .vdb file (resampled when its voxel size or transform differs); then `add` united, `cut` taken away.
/// Analytic values are exact in the whole band. Those of a mesh are exact but for a few 2.4 to 3 voxels off
/// an edge, and their signs are those of the surface (docs/commands.md, Slits and gaps); a rebuilt .vdb keeps its
/// surface to about 0.1 voxels. |phi| never exceeds the background. Validated before OpenVDB sees it. Throws InputError
/// (NaN, bad index, open surface, empty body, wrong grid class, with file and place), FileError, LimitError (when the
/// estimate passes `memoryLimit` bytes). Adds to `notes` what is not as in the source: gaps of a mesh that are too
/// narrow for the voxels, and are filled.
LevelSet makeLevelSet(const scene::Body& body, const scene::Grid& grid, std::uint64_t memoryLimit,
                      std::vector<std::string>* notes = nullptr);

/// The band of a collider that was read from a file.
LevelSet makeLevelSet(const scene::Collider& collider, const scene::Grid& grid, std::uint64_t memoryLimit);

/// The same with voxels no smaller than the longest side over `across`: what it looks like, at a bounded cost.
LevelSet makeOutline(const scene::Body& body, const scene::Grid& grid, int across, std::uint64_t memoryLimit);
LevelSet makeOutline(const scene::Collider& collider, const scene::Grid& grid, int across, std::uint64_t memoryLimit);

/// phi of the body whose level set this is, between voxels too: solids as they are, what was read by cubic
/// interpolation. Shares the grid, which must not change meanwhile.
tetmesh::RestShape restShape(const scene::Body& body, const LevelSet& phi);

}  // namespace vdbfrac::grid
