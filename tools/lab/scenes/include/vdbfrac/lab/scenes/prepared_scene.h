// A scene that is ready to step.
#pragma once

#include <vdbfrac/core/simulation.h>
#include <vdbfrac/core/stages.h>
#include <vdbfrac/scene/scene.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace vdbfrac::lab {

/// A scene with the effects that it names and its simulation, which refers to them.
struct PreparedScene {
    scene::Scene scene;
    std::vector<std::unique_ptr<core::Effect>> effects;
    core::Simulation simulation;

    /// `memoryLimit` in bytes. `witness`: an effect that joins last; it must live as long. Throws InputError also where
    /// nothing in the scene makes a field of output.vdb.
    PreparedScene(scene::Scene what, std::uint64_t memoryLimit, core::Effect* witness = nullptr);

    /// Is the last frame of the scene done?
    bool atEnd() const { return simulation.framesDone() >= scene.time.lastFrame - scene.time.firstFrame; }
};

/// Throws InputError where keys of an effect and of the rest do not go together, or nothing makes a field of
/// output.vdb; makes no bodies. Reads the files of colliders.
void requireSound(const scene::Scene& scene);

}  // namespace vdbfrac::lab
