// A light piece beside a hard one: what the norm of all forces does not show.
#include <vdbfrac/lab/scenes/scene_run.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

using namespace vdbfrac;
using lab::SceneRun;

namespace {

/// A soft crumb falls on the floor beside a block 1e7 times as hard, which is squeezed and at rest by then.
std::string crumb()
{
    std::string scene =
        "version = 1\nname = \"crumb\"\n[time]\nframes = [1, 13]\nfps = 24\n[grid]\nvoxel_size = 0.01\n"
        "[[body]]\nname = \"block\"\nmaterial = \"hard\"\n"
        "shape = { box = { size = [0.1, 0.1, 0.1], center = [0, 0.1, 0] } }\n"
        "[[body]]\nname = \"crumb\"\nmaterial = \"soft\"\n"
        "shape = { box = { size = [0.03, 0.03, 0.03], center = [0.2, 0.12, 0] } }\n"
        "[material.hard]\nyoungs_modulus = 1e11\npoisson_ratio = 0.3\ndensity = 1000\n"
        "[material.soft]\nyoungs_modulus = 1e4\npoisson_ratio = 0.3\ndensity = 1000\n"
        "[[collider]]\nshape = { halfspace = { normal = [0, -1, 0] } }\n[gravity]\n"
        "[damping]\nmass = 0.5\nstiffness = 0.1\n";
    for (const char* grip : {"[0, 1, 0], offset = 0.14 } }\nmove = { keys = [{ time = 0 }, { time = 0.1, translate = "
                             "[0, 0.05, 0] }] }\n",
                             "[0, -1, 0], offset = -0.06 } }\nmove = { velocity = [0, 0, 0] }\n"})
        scene += std::string("[[grip]]\nbody = \"block\"\nregion = { halfspace = { normal = ") + grip;
    return scene;
}

/// Its forces are a millionth of the block's: less than what the norm of all has to be solved to.
TEST(LightPiece, IsStoppedByTheFloor)
{
    constexpr double kDx = .01;  // m
    SceneRun run(crumb());
    double deepest = 0;
    while (!run.atEnd()) deepest = std::max(deepest, run.step().measured.at("collider_depth_m"));
    EXPECT_GT(deepest, .01 * kDx);  // it has come down
    EXPECT_LT(deepest, .06 * kDx);
}

}  // namespace
