// What a scene can choose of accuracy: each choice runs, does what it says, and tears alike.
#include "notched_bar.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/core/drawing.h>
#include <vdbfrac/lab/scenes/scene_run.h>
#include <vdbfrac/tetmesh/stencil.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

using namespace vdbfrac;

namespace {

const std::string kElastic =
    test::NotchedBar{.frames = 25, .fps = 24, .voxelSize = 0.05, .substeps = "2", .thickness = 0.3}.text("");
const std::string kBar = kElastic + "[fracture]\nkappa = 1000\n";

/// A scene that is filled in code may name what it does not have.
TEST(ScenesInCode, ThatNameWhatIsNotThereAreRefused)
{
    const lab::SceneRun run(kElastic);
    const auto isRefused = [](const scene::Scene& scene) {
        EXPECT_THROW(core::Simulation(scene, {}, std::uint64_t{1} << 30), InputError);
    };
    scene::Scene scene = run.scene;
    scene.bodies[0].material = "none";
    isRefused(scene);
    scene = run.scene;
    scene.grips[0].body = "none";
    isRefused(scene);
}

class Choices : public testing::TestWithParam<const char*> {};

TEST_P(Choices, TearTheBarInTwo)
{
    // Of the peak load of the default: all are the same bar, but for whole tets and loose phi.
    constexpr double kSame = 0.3;
    lab::SceneRun usual(kBar), chosen(kBar, {GetParam()});
    usual.toEnd(), chosen.toEnd();
    EXPECT_EQ(usual.simulation.fragments(), 2u);
    EXPECT_EQ(chosen.simulation.fragments(), 2u);
    EXPECT_NEAR(chosen.peakLoad(0, 1), usual.peakLoad(0, 1), kSame * usual.peakLoad(0, 1));
    double volume = chosen.simulation.startVolume();
    for (const core::StepRecord& step : chosen.steps) {
        EXPECT_LE(step.volume, volume * (1 + 1e-12)) << "step " << step.step;
        volume = step.volume;
    }
    EXPECT_NE(chosen.simulation.stateHash(), usual.simulation.stateHash()) << "the key has no effect";
}

INSTANTIATE_TEST_SUITE_P(Knobs, Choices,
                         testing::Values("solver.integrator=\"midpoint\"", "solver.integrator=\"sdirk2\"",
                                         "solver.integrator=\"static\"", "solver.strain=\"linear\"",
                                         "solver.tangent=\"projected\"", "solver.tangent=\"warped\"",
                                         "solver.precision=\"double\"", "grid.surface=\"whole_tets\"",
                                         "fracture.relevel=\"first_order\"", "fracture.relevel_every=4"));

TEST(Choices, ExplicitIntegratorsTearToo)
{
    lab::SceneRun chosen(kBar, {"solver.integrator=\"symplectic_euler\"", "time.substeps=\"auto\""});
    chosen.toEnd();
    EXPECT_EQ(chosen.simulation.fragments(), 2u);
    for (const core::StepRecord& step : chosen.steps) EXPECT_EQ(step.newtonIterations, 0);
}

TEST(Choices, StaticStepsSayWhatTheyLeaveWhereItIs)
{
    const std::string ball =
        "version = 1\n[time]\nframes = [1, 2]\n[grid]\nvoxel_size = 0.1\n[material.m]\nyoungs_modulus = 1e5\n"
        "poisson_ratio = 0.3\ndensity = 1000\n[[body]]\nname = \"b\"\nmaterial = \"m\"\n"
        "shape = { sphere = { radius = 0.3 } }\nvelocity = [1, 0, 0]\n[gravity]\n"
        "[[grip]]\nname = \"pull\"\nbody = \"b\"\nregion = { halfspace = { normal = \"y\", offset = 0.2 } }\n";
    const auto notes = [&](const char* move, const char* integrator) {
        lab::SceneRun run(ball + "move = " + move + "\n", {std::string("solver.integrator=\"") + integrator + "\""});
        std::string all;
        for (const std::string& note : run.simulation.stages().notes) all += note + "\n";
        return all;
    };
    const char *force = "{ force = [0, 500, 0] }", *hold = "{ velocity = [0, 0, 0] }";
    EXPECT_NE(notes(force, "static").find("held by no grip that says where it goes"), std::string::npos);
    EXPECT_NE(notes(force, "static").find("has a velocity"), std::string::npos);
    EXPECT_EQ(notes(hold, "static").find("held by no grip"), std::string::npos);
    EXPECT_EQ(notes(force, "backward_euler").find("static"), std::string::npos);
}

/// What weighs more than it can bear is told, by all that says so: most often a unit is another.
TEST(Choices, WhatItsWeightFlattensIsNoted)
{
    const auto notes = [](const std::string& height, const std::string& density, const std::string& gravity) {
        lab::SceneRun run(
            "version = 1\n[time]\nframes = [1, 2]\n[grid]\nvoxel_size = 0.1\n[material.m]\n"
            "youngs_modulus = 1e4\npoisson_ratio = 0.3\ndensity = " +
            density + "\n[[body]]\nname = \"b\"\nmaterial = \"m\"\nshape = { box = { size = [0.5, " + height +
            ", 0.5] } }\n[gravity]\nacceleration = " + gravity + "\n");
        std::string all;
        for (const std::string& note : run.simulation.stages().notes) all += note + "\n";
        return all;
    };
    EXPECT_NE(notes("2", "1000", "[0, -10, 0]").find("'b' would be flattened by its own weight"), std::string::npos);
    EXPECT_NE(notes("2", "1000", "[0, -10, 0]").find("is 2 times its Young's modulus"), std::string::npos);
    EXPECT_EQ(notes("0.5", "1000", "[0, -10, 0]").find("weight"), std::string::npos);
    EXPECT_EQ(notes("2", "400", "[0, -10, 0]").find("weight"), std::string::npos);
    EXPECT_EQ(notes("2", "1000", "[0, 0, 0]").find("weight"), std::string::npos);
    EXPECT_EQ(notes("2", "1000", "[-10, 0, 0]").find("weight"), std::string::npos);  // it is .5 m wide
}

/// What a tet at a time takes goes altogether: its lips, however closed, are drawn no more, and the run goes on.
TEST(Choices, WhatIsEatenUpIsDrawnNoMore)
{
    lab::SceneRun run(
        "version = 1\n[time]\nframes = [1, 4]\n[grid]\nvoxel_size = 0.05\nsurface = \"whole_tets\"\n[material.m]\n"
        "youngs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n[[body]]\nname = \"ball\"\nmaterial = \"m\"\n"
        "shape = { sphere = { radius = 0.18 } }\nangular_velocity = [0, 0, 30]\n[[body]]\nname = \"block\"\n"
        "material = \"m\"\nshape = { box = { size = [0.38, 0.38, 0.38], center = [2, 0, 0] } }\n[fracture]\n"
        "kappa = 1\ndriver = \"full\"\n");
    core::Drawing drawing(run.scene, run.simulation);
    while (!run.atEnd()) run.step(), drawing.follow(run.simulation, run.work);
    EXPECT_TRUE(run.simulation.bodies()[0].mesh->elements().empty());
    EXPECT_EQ(drawing.frame(run.simulation)[0].topology->mesh.faces(), 0u);
    EXPECT_GT(drawing.frame(run.simulation)[1].topology->mesh.faces(), 0u);
}

TEST(Choices, AnExplicitIntegratorWithLongStepsSaysSo)
{
    lab::SceneRun chosen(kElastic, {"solver.integrator=\"forward_euler\"", "time.substeps=1", "time.frames=[1,200]"});
    const auto& notes = chosen.simulation.stages().notes;
    EXPECT_TRUE(std::any_of(notes.begin(), notes.end(),
                            [](const std::string& n) { return n.find("unstable beyond") != std::string::npos; }));
    try {
        chosen.toEnd();
        FAIL() << "it should have left what a number can hold";
    } catch (const LimitError& error) {
        EXPECT_NE(std::string(error.what()).find("explicit integrator"), std::string::npos) << error.what();
    }
    EXPECT_EQ(chosen.steps.front().outcome, core::Outcome::converged);
    EXPECT_EQ(chosen.steps.back().outcome, core::Outcome::capped);
}

/// Contact stores energy and gives it back in each bounce; that is no work that was put in, whatever it adds up to.
TEST(Choices, StepsThatFlyApartOnAColliderSaySo)
{
    lab::SceneRun run(R"(
grid = { voxel_size = 0.1 }
time = { frames = [1, 40] }
solver = { integrator = "forward_euler" }
gravity = {}
[material.rubber]
youngs_modulus = 5e4
poisson_ratio = 0.3
density = 1000
[[body]]
name = "ball"
material = "rubber"
shape = { sphere = { radius = 0.4, center = [0, 0.6, 0] } }
[[collider]]
shape = { halfspace = { normal = [0, -1, 0] } }
)");
    const double fall = .2 * 9.81 * 1000 * run.simulation.startVolume();  // J
    while (!run.atEnd() && run.steps.size() < 20000) {
        run.step();
        if (run.steps.back().outcome == core::Outcome::capped) return;
        ASSERT_LT(run.steps.back().kineticEnergy + run.steps.back().elasticEnergy, 200 * fall) << run.steps.back().time;
    }
    FAIL() << "forward Euler should have gained energy";
}

/// What moves so fast that no step is short enough ends the run, not in a step that takes no time for ever.
TEST(Choices, StepsThatTakeNoTimeAreRefused)
{
    lab::SceneRun run(kElastic, {"body.0.angular_velocity=[1e160,0,0]", "time.substeps=\"auto\""});
    EXPECT_THROW(run.toEnd(), LimitError);
}

TEST(Choices, AutoKnowsThatDampingLowersTheStepOfExplicitIntegrators)
{
    const std::string scheme = "solver.integrator=\"symplectic_euler\"", frames = "time.frames=[1,3]",
                      damping = "damping.stiffness=0.05";
    lab::SceneRun free(kElastic, {scheme, frames, "time.substeps=\"auto\""});
    lab::SceneRun damped(kElastic, {scheme, frames, damping, "time.substeps=\"auto\""});
    free.toEnd(), damped.toEnd();
    EXPECT_LT(damped.steps.back().elasticEnergy, 2 * free.steps.back().elasticEnergy);
    lab::SceneRun stepsOfFree(kElastic,
                              {scheme, frames, damping, "time.substeps=" + std::to_string(free.steps.size() / 2)});
    stepsOfFree.toEnd();
    EXPECT_GT(stepsOfFree.steps.back().elasticEnergy, 1e6 * free.steps.back().elasticEnergy)
        << "the test shows nothing";
}

TEST(Choices, StaticStepsHaveNoVelocitiesFromTheStart)
{
    const auto fastest = [](const lab::SceneRun& run) {
        double v = 0;
        for (const Vec3& one : run.simulation.v()) v = std::max(v, one.norm());
        return v;
    };
    lab::SceneRun moving(kElastic), still(kElastic, {"solver.integrator=\"static\""});
    EXPECT_GT(fastest(moving), 0);  // of what the grips hold
    EXPECT_EQ(fastest(still), 0);
    still.step();
    EXPECT_EQ(fastest(still), 0);
}

TEST(Choices, WholeTetsHaveNearlyTheVolumeOfTheShape)
{
    constexpr double kAllowed = 0.05;  // a ball 8 voxels across: jags of half a voxel, in the mean none
    const auto volume = [](const char* surface) {
        return lab::SceneRun(R"(
version = 1
[grid]
voxel_size = 0.05
[[body]]
name = "bar"
shape = { sphere = { radius = 0.2, center = [0.01, 0.02, 0.017] } }
material = "gel"
[material.gel]
youngs_modulus = 1e5
poisson_ratio = 0.3
density = 1000
)",
                             {std::string("grid.surface=\"") + surface + '"'})
            .simulation.volume();
    };
    EXPECT_NEAR(volume("whole_tets"), volume("cut_planes"), kAllowed * volume("cut_planes"));
    EXPECT_NE(volume("whole_tets"), volume("cut_planes"));
}

/// A unit cube of 50 voxels an edge, pulled at top and bottom, on the coarsest lattice there is: some three cells an
/// edge.
TEST(Coarsening, TheCoarsestLatticeSetsUpAndSteps)
{
    constexpr double kRounded = 1e-3;  // of the volume: edges of the level set are cut off within a voxel
    lab::SceneRun run(R"(
version = 1
[time]
frames = [1, 3]
fps = 24
substeps = 1
[grid]
voxel_size = 0.02
coarsening = 19
[[body]]
name = "cube"
shape = { box = { size = [1, 1, 1], center = [0.003, 0.004, 0.005] } }
material = "gel"
[material.gel]
youngs_modulus = 1e5
poisson_ratio = 0.3
density = 1000
[[grip]]
body = "cube"
region = { halfspace = { normal = [0, 1, 0], offset = 0.3 } }
move = { velocity = [0, 0.1, 0] }
[[grip]]
body = "cube"
region = { halfspace = { normal = [0, -1, 0], offset = 0.3 } }
move = { velocity = [0, -0.1, 0] }
[fracture]
toughness = 1000
)");
    EXPECT_NEAR(run.simulation.startVolume(), 1, kRounded);
    run.toEnd();
    ASSERT_EQ(run.steps.size(), 2u);
    for (const core::StepRecord& step : run.steps) EXPECT_EQ(step.outcome, core::Outcome::converged);
    EXPECT_EQ(run.simulation.fragments(), 1u);
    EXPECT_GT(run.peakLoad(0, 1), 0);
    EXPECT_EQ(run.scene.grid.coarsening, tetmesh::kMaxCoarsening);
    EXPECT_THROW(lab::SceneRun(kElastic, {"grid.coarsening=" + std::to_string(tetmesh::kMaxCoarsening + 1)}),
                 InputError);
}

}  // namespace
