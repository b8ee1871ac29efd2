// Uses vdbfrac as libraries: a soft bar is hung up by one end and sags under its weight.
#include <vdbfrac/base/error.h>
#include <vdbfrac/core/simulation.h>
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/grid/openvdb.h>
#include <vdbfrac/scene/reader.h>

#include <openvdb/tools/LevelSetSphere.h>

#include <cstdint>
#include <cstdio>

constexpr const char* kScene = R"(
version = 1
[grid]
voxel_size = 0.1
[[body]]
name = "bar"
shape = { box = { size = [0.4, 1.2, 0.4] } }
material = "gel"
[material.gel]
youngs_modulus = 1e5
poisson_ratio = 0.3
density = 1000
[[grip]]
body = "bar"
region = { halfspace = { normal = "y", offset = 0.55 } }
move = { velocity = [0, 0, 0] }
[gravity]
)";

int main()
try {
    const auto scene = vdbfrac::scene::parseScene(kScene, "built-in", vdbfrac::effects::vocabulary());
    const auto effects = vdbfrac::effects::makeEffects(scene);  // has to outlive the simulation
    std::vector<vdbfrac::core::Effect*> pointers;
    for (const auto& effect : effects) pointers.push_back(effect.get());
    const std::uint64_t memoryLimit = std::uint64_t(1) << 30;  // bytes
    vdbfrac::core::Simulation bar(scene, pointers, memoryLimit);

    const auto step = bar.step(1 / scene.time.fps);
    const double weight = 0.4 * 1.2 * 0.4 * 1000 * 9.81;
    std::printf("after %.3f s the grip carries %.1f N, the bar weighs %.1f N\n", bar.time(), step.gripLoad[0].y(),
                weight);
    // A level set of the program that this is loaded into, and back.
    const auto ball = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(0.3f, openvdb::Vec3f(0), 0.05f);
    const auto phi = vdbfrac::grid::fromOpenVdb(*ball).levelSet;
    if (vdbfrac::grid::toOpenVdb(phi)->activeVoxelCount() != ball->activeVoxelCount()) return 1;
    return step.outcome == vdbfrac::core::Outcome::converged && step.gripLoad[0].y() > 0 ? 0 : 1;
} catch (const vdbfrac::Error& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 2;
}
