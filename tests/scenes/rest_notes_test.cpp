// What a run says of its bodies before the first step.
#include <vdbfrac/lab/scenes/scene_run.h>

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

using namespace vdbfrac;
using lab::SceneRun;

namespace {

/// How thick, in lattice cells, a body is said to be; 0: nothing is said.
double toldThickness(const std::string& shape)
{
    SceneRun run("version = 1\n[grid]\nvoxel_size = 0.1\n[[body]]\nname = \"b\"\nmaterial = \"m\"\n" + shape +
                 "\n[material.m]\nyoungs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n");
    const std::string before = "nowhere more than about ";
    for (const std::string& note : run.simulation.stages().notes)
        if (const std::size_t at = note.find(before); at != std::string::npos)
            return std::atof(note.c_str() + at + before.size());
    return 0;
}

TEST(RestNotes, ThinPlatesAndShellsAreToldHoweverTheyLie)
{
    constexpr double kNear = .3;  // of a cell, of its walls as the level set has them
    const std::string turned = ", rotate = [20, 35, 50]";
    for (const std::string& how : {std::string(), turned}) {
        EXPECT_NEAR(toldThickness("shape = { box = { size = [1.5, 0.3, 1.5]" + how + " } }"), 3, kNear) << how;
        EXPECT_NEAR(toldThickness("shape = { box = { size = [1.5, 0.24, 1.5]" + how + " } }"), 2.4, kNear) << how;
        EXPECT_EQ(toldThickness("shape = { box = { size = [1.5, 0.46, 1.5]" + how + " } }"), 0) << how;
    }
    const auto ball = [](const std::string& radius) { return "{ sphere = { radius = " + radius + " } }"; };
    EXPECT_NEAR(toldThickness("shape = " + ball("1.2") + "\ncut = [" + ball("0.9") + "]"), 3, kNear);
    EXPECT_NEAR(toldThickness("shape = " + ball("1.2") + "\ncut = [" + ball("0.97") + "]"), 2.3, kNear);
    EXPECT_EQ(toldThickness("shape = " + ball("1.2") + "\ncut = [" + ball("0.7") + "]"), 0);
    EXPECT_EQ(toldThickness("shape = " + ball("1.2")), 0);
}

}  // namespace
