// What a scene will take, before anything of its size is made: from the volume and the surface of its bodies.
#pragma once

#include <vdbfrac/grid/level_set.h>
#include <vdbfrac/scene/scene.h>

#include <cstdint>
#include <vector>

namespace vdbfrac::core {

struct BodyEstimate {
    const scene::Body* body = nullptr;
    grid::LevelSet outline;       ///< as fine as its volume and surface need, with a bounded number of voxels
    double volume = 0, area = 0;  ///< m^3, m^2
    double tets = 0, nodes = 0, surfaceVoxels = 0;

    Bounds bounds() const;  ///< m, of its surface, to a voxel of the outline
};

struct SceneEstimate {
    std::vector<BodyEstimate> bodies;
    double tets = 0, nodes = 0;
    double colliderBytes = 0;  ///< of the files of colliders
    double bytes = 0;          ///< peak of a run, with what system and libraries need
    /// What takes most of it.
    struct Largest {
        std::string what;  ///< body or collider
        double length = 0, bytes = 0;
    } largest;
};

/// Reads the files that the scene names. Throws InputError (also for a grip that is far from all material of its body),
/// FileError, LimitError for a file or an outline larger than `memoryLimit` bytes. Does not judge `bytes`.
/// `bytesPerTet`: what effects take beside the rest.
SceneEstimate estimateScene(const scene::Scene& scene, std::uint64_t memoryLimit, double bytesPerTet);

/// Throws LimitError when a run would take more than `limit` bytes.
void requireMemory(const SceneEstimate& estimate, std::uint64_t limit);

}  // namespace vdbfrac::core
