// The scene that ships, at any resolution.
#pragma once

#include <vdbfrac/core/simulation.h>
#include <vdbfrac/core/stages.h>
#include <vdbfrac/scene/scene.h>

#include <memory>
#include <vector>

namespace vdbfrac::tools::bench {

/// data/scenes/notched_block.toml with so many voxels along an edge, from frame 1 to `lastFrame`.
scene::Scene notchedBlock(int voxels, int lastFrame);

/// A scene with its effects and its simulation.
struct Prepared {
    scene::Scene scene;
    std::vector<std::unique_ptr<core::Effect>> effects;
    core::Simulation simulation;

    explicit Prepared(scene::Scene what);
};

}  // namespace vdbfrac::tools::bench
