// What a scene does not call for costs nothing; the bits do not depend on the threads.
#include "notched_bar.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

using namespace vdbfrac;
using lab::SceneRun;

namespace {

std::string notchedBar(double length, const std::string& effects)
{
    return test::NotchedBar{.frames = 60, .fps = 24, .voxelSize = 0.05, .length = length, .thickness = 0.3}.text(
        effects);
}

const char* const kTear = "[damping]\nstiffness = 0.002\n[fracture]\ntoughness = 120\n";

TEST(OnlyWhatIsAsked, StagesOfEffectsThatAreNotNamedNeverWork)
{
    SceneRun run(notchedBar(1, ""));
    run.toFrame(6);
    for (const char* stage : {"fracture", "relevel", "energy", "cut"}) {
        EXPECT_EQ(run.work.countOf(stage, "calls"), 0) << stage;
        EXPECT_EQ(run.work.secondsOf(stage), 0) << stage;
    }
    EXPECT_EQ(run.work.stages().size(), 1u);
    EXPECT_EQ(run.work.stages()[0].name, "solve");
    EXPECT_TRUE(run.simulation.stages().solve.empty());
    EXPECT_TRUE(run.simulation.stages().grid.empty());
    EXPECT_TRUE(run.simulation.stages().limits.empty());
    EXPECT_EQ(run.simulation.stages().frames.size(), 1u);  // phi and energy
}

TEST(OnlyWhatIsAsked, AnEffectThatCannotActLeavesTheStateAsIfItWereOmitted)
{
    const auto hash = [](const std::string& effects) {
        SceneRun run(notchedBar(1, effects));
        run.toFrame(10);
        return run.simulation.stateHash();
    };
    const std::uint64_t bare = hash("");
    EXPECT_EQ(hash("[fracture]\nkappa = 1e300\n"), bare);
    EXPECT_EQ(hash("[fracture]\ntoughness = 1e300\n"), bare);
    EXPECT_EQ(hash("[gravity]\nacceleration = [0, 0, 0]\n"), bare);
    EXPECT_NE(hash("[gravity]\n"), bare);  // the hash does see an effect that acts
}

TEST(OnlyWhatIsAsked, WorkOfACrackDoesNotGrowWithTheBody)
{
    struct Work {
        std::int64_t fracture, moved, relevel, cells, grouped, nodes;
    };
    const auto tear = [](double length) {
        SceneRun run(notchedBar(length, kTear));
        run.toFrame(60);
        EXPECT_GE(run.simulation.fragments(), 2u) << length;
        return Work{run.work.countOf("fracture", "voxels"),   run.work.countOf("fracture", "moved_voxels"),
                    run.work.countOf("relevel", "voxels"),    run.work.countOf("cut", "cells"),
                    run.work.countOf("cut", "grouped_cells"), run.work.countOf("cut", "classified_nodes")};
    };
    const Work one = tear(2);  // a shorter one feels its grips
    ASSERT_GT(one.cells, 0);
    for (double length : {4., 8.}) {
        const Work more = tear(length);
        EXPECT_NEAR(double(more.fracture), double(one.fracture), 0.1 * double(one.fracture)) << length;
        EXPECT_NEAR(double(more.moved), double(one.moved), 0.1 * double(one.moved)) << length;
        EXPECT_NEAR(double(more.relevel), double(one.relevel), 0.1 * double(one.relevel)) << length;
        EXPECT_NEAR(double(more.cells), double(one.cells), 0.1 * double(one.cells)) << length;
        EXPECT_NEAR(double(more.grouped), double(one.grouped), 0.1 * double(one.grouped)) << length;
        EXPECT_NEAR(double(more.nodes), double(one.nodes), 0.1 * double(one.nodes)) << length;
    }
}

TEST(OnlyWhatIsAsked, EmptySpaceCostsNeitherMemoryNorWork)
{
    const auto twoBlocks = [](double apart) {
        std::ostringstream s;
        s << "version = 1\nname = \"pair\"\n[time]\nframes = [1, 3]\n[grid]\nvoxel_size = 0.05\n[[body]]\nname = "
             "\"pair\"\n"
             "shape = { box = { size = [1, 1, 1] } }\nadd = [{ box = { size = [1, 1, 1], center = ["
          << apart << ", " << apart
          << ", 0] } }]\nmaterial = \"m\"\n[material.m]\nyoungs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n";
        return s.str();
    };
    SceneRun near(twoBlocks(2.4)), far(twoBlocks(4.8));  // 1.4 and 3.8 of emptiness between them
    near.toEnd(), far.toEnd();
    const auto bytes = [](const SceneRun& r) {
        const core::Simulation& s = r.simulation;
        return double(s.elastic().bytes() + s.integrator().bytes() + s.bodies()[0].mesh->phi().bytes() +
                      s.bodies()[0].phi.activeVoxels() * sizeof(float));
    };
    EXPECT_LE(bytes(far), 1.05 * bytes(near));
    EXPECT_EQ(far.simulation.elastic().tetCount(), near.simulation.elastic().tetCount());
    EXPECT_EQ(far.work.countOf("solve", "evaluated_tets"), near.work.countOf("solve", "evaluated_tets"));
}

TEST(Determinism, EveryFrameHasTheSameStateForAnyNumberOfThreads)
{
    std::vector<std::uint64_t> expected;
    for (int threads : {1, 2, 3, 8}) {
        const ThreadLimit limit(threads);
        SceneRun run(notchedBar(1, kTear));
        std::vector<std::uint64_t> hashes;
        for (int frame = 1; frame <= 24; ++frame) {
            run.toFrame(frame);
            hashes.push_back(run.simulation.stateHash());
        }
        EXPECT_GT(run.work.countOf("cut", "cells"), 0);
        if (expected.empty()) expected = hashes;
        EXPECT_EQ(hashes, expected) << threads;
    }
}

TEST(Determinism, WhatTouchesTearsAndSleepsHasTheSameStateForAnyNumberOfThreads)
{
    const std::string more = std::string(kTear) +
                             "[gravity]\n[contact]\n[sleep]\nafter = 0.1\n[[collider]]\n"
                             "shape = { sphere = { radius = 0.3, center = [0.05, 0.02, 0.46] } }\n"
                             "[[body]]\nname = \"stone\"\nmaterial = \"m\"\nvelocity = [-2, 0, 0]\n"
                             "shape = { box = { size = [0.2, 0.2, 0.2], center = [0.33, 0.3, 0.01] } }\n";
    std::vector<std::uint64_t> expected;
    for (int threads : {1, 2, 3, 8}) {
        const ThreadLimit limit(threads);
        SceneRun run(notchedBar(1, more));
        std::vector<std::uint64_t> hashes;
        for (int frame = 1; frame <= 16; ++frame) {
            run.toFrame(frame);
            hashes.push_back(run.simulation.stateHash());
        }
        EXPECT_GT(run.work.countOf("solve", "couplings"), 0);
        if (expected.empty()) expected = hashes;
        EXPECT_EQ(hashes, expected) << threads;
    }
}

TEST(Recut, MassIsConservedButForWhatTheCracksTook)
{
    SceneRun run(notchedBar(1, kTear));
    run.toFrame(40);
    const auto mass = run.simulation.elastic().mass();
    double sum = 0;
    for (double m : mass) sum += m;
    EXPECT_NEAR(sum, 1000 * run.simulation.volume(), 1e-12 * sum);
    double fragments = 0;
    for (const auto& f : run.simulation.bodies()[0].fragments.fragments()) fragments += f.restVolume;
    EXPECT_NEAR(fragments, run.simulation.volume(), 1e-12 * fragments);
}

TEST(Material, NeverGrows)
{
    SceneRun run(notchedBar(1, kTear));
    run.toFrame(40);
    double before = run.simulation.startVolume();
    for (const core::StepRecord& s : run.steps) {
        EXPECT_LE(s.volume, before * (1 + 1e-14));
        before = s.volume;
    }
    EXPECT_LT(before, run.simulation.startVolume()) << "nothing tore";
}

}  // namespace
