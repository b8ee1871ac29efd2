// The effect of effects/README.md: a coupling, a value of each tet, a grid, a column and checkpoints, in one file and
// one line.
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/lab/scenes/saw.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

using namespace vdbfrac;
using lab::SceneRun;

namespace {

/// A bar of two voxels to a cell; a saw parts it. Its right half flies off.
std::string bar(const std::string& more)
{
    return "version = 1\ntime = { frames = [1, 13], fps = 24, substeps = 2 }\n"
           "grid = { voxel_size = 0.05, coarsening = 2 }\nsolver = { newton_tolerance = 1e-9, linear_tolerance = 1e-6 "
           "}\n"
           "output.vdb = [\"phi\", \"bruise\"]\n"
           "[[body]]\nname = \"bar\"\nshape = { box = { size = [1.6, 0.4, 0.4] } }\nmaterial = \"gel\"\n"
           "[material.gel]\nyoungs_modulus = 1e4\npoisson_ratio = 0.3\ndensity = 1000\n"
           "[[grip]]\nbody = \"bar\"\nregion = { halfspace = { normal = \"x\", offset = 0.6 } }\n"
           "move = { velocity = [1, 0, 0] }\n" +
           more;
}

std::string stitch(double stiffness)
{
    return "[stitch]\nbody = \"bar\"\nfrom = [-0.31, 0.03, 0.02]\nto = [0.27, -0.04, 0.01]\nstiffness = " +
           std::to_string(stiffness) + "\n";
}

Vec3 momentumOfLeft(const SceneRun& run)
{
    const core::Body& body = run.simulation.bodies()[0];
    Vec3 sum = Vec3::Zero();
    for (std::uint32_t n = 0; n < body.mesh->nodeCount(); ++n)
        if (body.mesh->restPosition(n).x() < 0) sum += run.simulation.elastic().mass()[n] * run.simulation.v()[n];
    return sum;
}

TEST(Stitch, DragsTheHalfThatNothingHoldsAlongAfterTheCut)
{
    lab::Saw saw(0, 0.06);
    SceneRun loose(bar(""), {"output.vdb=[\"phi\"]"}, &saw);
    loose.toFrame(13);
    lab::Saw again(0, 0.06);
    SceneRun tied(bar(stitch(2000)), {}, &again);
    tied.toFrame(13);
    ASSERT_EQ(loose.simulation.fragments(), 2u);
    ASSERT_EQ(tied.simulation.fragments(), 2u);
    EXPECT_GT(momentumOfLeft(tied).x(), 5 * std::abs(momentumOfLeft(loose).x()));
    EXPECT_EQ(tied.steps.back().work.countOf("solve", "couplings"), 1);
    EXPECT_EQ(loose.steps.back().work.countOf("solve", "couplings"), 0);
}

/// What comes in, goes out and stays adds up, each by its own formula; and the thread's part is what it stores.
TEST(Stitch, WorkIsInTheEnergiesOfEachStep)
{
    constexpr double kSums = 1e-9;  // of the largest: what the tolerance of the solver leaves
    lab::Saw saw(0, 0.06);
    SceneRun run(bar(stitch(2000)), {}, &saw);
    double thread = 0, before = run.simulation.elastic().evaluate(run.simulation.x(), {}, nullptr);
    for (std::size_t i = 0; i < run.simulation.v().size(); ++i)
        before += 0.5 * run.simulation.elastic().mass()[i] * run.simulation.v()[i].squaredNorm();
    while (run.simulation.framesDone() < 12) {
        const core::StepRecord& step = run.step();
        double in = 0;
        for (const auto& [name, amount] : step.energyFlow)
            if (name != "unnamed")
                in += name == "integrator" || name == "removed" || name.ends_with("_dissipated") ? -amount : amount;
        const double after = step.kineticEnergy + step.elasticEnergy;
        EXPECT_NEAR(after - before, in, kSums * (after + before)) << step.step;
        before = after;
        if (step.energyFlow.contains("stitch_work")) thread += step.energyFlow.at("stitch_work");
    }
    EXPECT_LT(thread, 0);  // it has stored energy
    EXPECT_TRUE(run.steps.front().energyFlow.contains("removed"));
}

TEST(Stitch, BruiseOnlyGrowsAndIsInTheFrames)
{
    lab::Saw saw(0, 0.06);
    SceneRun run(bar(stitch(2000)), {}, &saw);
    const auto bruise = [&] {
        for (const core::FrameSource* source : run.simulation.stages().frames)
            for (const auto& field : source->fields())
                if (field.name == "bruise")
                    return std::get<grid::VoxelValues>(source->take(run.simulation.bodies()[0], "bruise"));
        return grid::VoxelValues();
    };
    run.toFrame(7);
    const auto highest = [](const grid::VoxelValues& values) {
        return *std::max_element(values.scalars.begin(), values.scalars.end());
    };
    const float before = highest(bruise());
    EXPECT_GT(before, 0);
    run.toFrame(13);
    EXPECT_GE(highest(bruise()), before);
    const grid::VoxelValues energy = run.simulation.energyField(run.simulation.bodies()[0]);
    const grid::VoxelValues now = bruise();
    ASSERT_EQ(now.scalars.size(), energy.scalars.size());
    constexpr float kFloat = 1e-5f;
    for (std::size_t i = 0; i < now.scalars.size(); ++i)
        ASSERT_GE(now.scalars[i], (1 - kFloat) * energy.scalars[i]) << i;
}

TEST(Stitch, RunFromACheckpointHasTheSameBits)
{
    const std::string text = bar(stitch(2000) + "[fracture]\nkappa = 20\n");
    SceneRun run(text);
    run.toFrame(7);
    core::Archive archive;
    run.simulation.save(archive);
    run.toFrame(13);
    SceneRun second(text);
    second.simulation.restoreFrom(core::Archive::parse(archive.bytes(), "memory"));
    second.toFrame(13);
    EXPECT_EQ(second.simulation.stateHash(), run.simulation.stateHash());
    EXPECT_EQ(second.steps.back().energyFlow, run.steps.back().energyFlow);
    core::Archive a, b;
    run.simulation.save(a);
    second.simulation.save(b);
    EXPECT_EQ(a.checksum(), b.checksum());
}

TEST(Stitch, ThatHasNoStiffnessLeavesTheStateAsIfItWereOmitted)
{
    lab::Saw saw(0, 0.06), again(0, 0.06);
    SceneRun with(bar(stitch(0)), {}, &saw), without(bar(""), {"output.vdb=[\"phi\"]"}, &again);
    with.toFrame(5);
    without.toFrame(5);
    EXPECT_EQ(with.simulation.stateHash(), without.simulation.stateHash());
}

TEST(Stitch, IsKnownToTheSceneAndToNothingElse)
{
    EXPECT_THROW(SceneRun(bar(""), {"output.vdb=[\"phi\"]", "stitch.stifness=1"}), std::exception);
    EXPECT_THROW(SceneRun(bar(stitch(1)), {"stitch.from=[9, 0, 0]"}), std::exception);
    EXPECT_EQ(effects::effectList().back().table.name, std::string("stitch"));
}

}  // namespace
