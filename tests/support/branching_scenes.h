// Scenes that branch: a bar that grips pull, torn or whole, and blocks that lie on each other; and checkpoints of them.
#pragma once

#include <vdbfrac/core/archive.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <string>
#include <vector>

namespace vdbfrac::test {

/// A bar 1 m long that grips pull at its ends, a tenth of a metre a second each.
inline std::string bar(const std::string& more = "")
{
    std::string s =
        "version = 1\nname = \"bar\"\n[time]\nframes = [1, 12]\nfps = 8\n[grid]\nvoxel_size = 0.1\n[material.m]\n"
        "youngs_modulus = 1e5\npoisson_ratio = 0\ndensity = 1000\n[[body]]\nname = \"b\"\nmaterial = \"m\"\n"
        "shape = { box = { size = [0.4, 1, 0.4] } }\n";
    for (const char* side : {"", "-"})
        s += std::string("[[grip]]\nname = \"") + (*side ? "low" : "high") +
             "\"\nbody = \"b\"\nregion = { box = { size = [1, 0.1, 1], center = [0, " + side +
             "0.5, 0] } }\nmove = { velocity = [0, " + side + "0.1, 0] }\n";
    return s + more;
}

/// Notched and torn by its pull.
inline std::string tearingBar(const std::string& more = "")
{
    return bar("[damping]\nstiffness = 0.002\n[fracture]\ntoughness = 60\n" + more);
}
inline const std::vector<std::string> kNotched = {
    "body.0.cut=[{ cylinder = { axis = \"z\", radius = 0.12, center = [0.2, 0.013, 0] } }]",
    "material.m.poisson_ratio=0.3"};

/// Two blocks, one on the other, that a floor holds.
inline std::string stack(const std::string& more)
{
    std::string scene =
        "version = 1\nname = \"pile\"\n[time]\nframes = [1, 60]\nfps = 24\n[grid]\nvoxel_size = 0.1\n[material.m]\n"
        "youngs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n[gravity]\n"
        "[[collider]]\nshape = { halfspace = { normal = [0, -1, 0], offset = 0 } }\n";
    for (const char* y : {"0.3", "0.85"})
        scene += std::string("[[body]]\nname = \"b") + y +
                 "\"\nmaterial = \"m\"\nshape = { box = { size = [0.5, 0.5, 0.5], center = [0, " + y + ", 0] } }\n";
    return scene + more;
}

inline core::Archive saved(const lab::SceneRun& run)
{
    core::Archive archive;
    run.simulation.save(archive);
    return archive;
}

}  // namespace vdbfrac::test
