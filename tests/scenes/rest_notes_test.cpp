// What a run says of its bodies before the first step.
#include <vdbfrac/lab/scenes/scene_run.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>

using namespace vdbfrac;
using lab::SceneRun;

namespace {

/// Of one body, with voxels of .1 m.
std::string sceneOf(const std::string& shape)
{
    return "version = 1\n[grid]\nvoxel_size = 0.1\n[[body]]\nname = \"b\"\nmaterial = \"m\"\n" + shape +
           "\n[material.m]\nyoungs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n";
}

/// How thick, in lattice cells, a body is said to be; 0: nothing is said.
double toldThickness(const std::string& shape)
{
    SceneRun run(sceneOf(shape));
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

/// A cube of 1 m, and beside it one with an edge of `edge` [m], `gap` [m] away.
struct TwoCubes {
    double edge, gap;
    std::size_t parts, crumbs;
};

/// What comes off a body because it is thinner there than a voxel would fall off it, and be drawn torn, from the start.
TEST(RestCrumbs, AreLeftOutBesideLargerParts)
{
    constexpr double kVolume = .003;  // m^3: corners
    for (const auto& [edge, gap, parts, crumbs] :
         {TwoCubes{.14, .13, 1, 1}, {.18, .13, 1, 1}, {.5, .2, 2, 0}, {.18, .6, 2, 0}}) {
        const std::string center = std::to_string(.5 + gap + edge / 2), size = std::to_string(edge);
        SceneRun run(sceneOf("shape = { box = { size = [1, 1, 1] } }\nadd = [{ box = { size = [" + size + ", " + size +
                             ", " + size + "], center = [" + center + ", 0.02, 0.02] } }]"));
        const core::Body& body = run.simulation.bodies()[0];
        EXPECT_EQ(body.fragments.fragments().size(), parts) << edge << ", " << gap;
        const auto isTold = [](const std::string& note) { return note.find("1 crumb of up to 8 voxels") != note.npos; };
        EXPECT_EQ(std::size_t(std::ranges::count_if(run.simulation.stages().notes, isTold)), crumbs)
            << edge << ", " << gap;
        const double other = crumbs > 0 ? 0 : edge * edge * edge;
        EXPECT_NEAR(body.mesh->volume(), 1 + other, kVolume) << edge << ", " << gap;
    }
}

}  // namespace
