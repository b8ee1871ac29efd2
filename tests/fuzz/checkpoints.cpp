// Checkpoints of a small scene that tears and touches: sound ones, and what 'vdbfrac sim --resume' does with any.
#include "checkpoints.h"

#include "run_records.h"
#include "sound_files.h"

#include <vdbfrac/core/archive.h>
#include <vdbfrac/lab/scenes/scene_run.h>

namespace vdbfrac::fuzz {

namespace {

constexpr const char* kScene = R"(version = 1
[time]
frames = [1, 6]
fps = 4
[grid]
voxel_size = 0.1
[material.m]
youngs_modulus = 1e5
poisson_ratio = 0.3
density = 1000
[[body]]
name = "bar"
material = "m"
shape = { box = { size = [0.3, 0.6, 0.3] } }
[[grip]]
body = "bar"
region = { halfspace = { normal = [0, -1, 0], offset = 0.2 } }
move = { velocity = [0, -0.1, 0] }
[[grip]]
body = "bar"
region = { halfspace = { normal = [0, 1, 0], offset = 0.2 } }
move = { velocity = [0, 0.1, 0] }
[[collider]]
shape = { halfspace = { normal = [1, 0, 0], offset = -0.14 } }
friction = 0.3
move = { velocity = [0.02, 0, 0] }
[fracture]
kappa = 200
grip_margin = 0.1
[contact]
friction = 0.3
lips = "closed"
[sleep]
speed = 0.01
[output]
motion = true
)";

}  // namespace

void resumeFrom(std::string_view bytes)
{
    const core::Archive archive = core::Archive::parse(bytes, "fuzz.ckpt", false);  // any mutation has another checksum
    core::loadFrames(archive);
    core::loadSteps(archive);
    lab::SceneRun run(kScene);
    run.simulation.restoreFrom(archive);
    // No step: from a state that no run leads to, it may take all the tries it has.
    (void)run.simulation.stateHash();
}

std::vector<std::string> soundCheckpoints()
{
    std::vector<std::string> files;
    lab::SceneRun run(kScene);
    const std::vector<core::FrameRecord> frames = {
        {1, 0, "0123456789abcdef", {{"obj/small.0001.obj", 10, "0123456789abcdef"}}}};
    for (const int frame : {1, 6}) {
        run.toFrame(frame);
        core::Archive archive;
        run.simulation.save(archive);
        core::saveRecords(run.steps, frames, archive);
        files.push_back(archive.bytes());
    }
    return files;
}

}  // namespace vdbfrac::fuzz
