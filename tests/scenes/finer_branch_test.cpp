// Branches with voxels half as wide: what they take over is what it was.
#include "branching_scenes.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/core/branch.h>
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/lab/scenes/scene_run.h>
#include <vdbfrac/scene/reader.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

using namespace vdbfrac;
using lab::SceneRun;
using namespace test;

namespace {

/// A run, and one with voxels half as wide that took over its state.
struct Refined {
    SceneRun wide, fine;

    Refined(const std::string& scene, std::vector<std::string> set, int frame)
        : wide(scene, set), fine(scene, finer(set))
    {
        wide.toFrame(frame);
        fine.simulation.refineFrom(wide.simulation, saved(wide));
    }
    static std::vector<std::string> finer(std::vector<std::string> set)
    {
        set.push_back("grid.voxel_size=0.05");
        return set;
    }
    std::string text(const SceneRun& run) const { return scene::writeScene(run.scene, effects::vocabulary()); }
};

Vec3 momentum(const core::Simulation& s)
{
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = 0; i < s.v().size(); ++i) sum += s.elastic().mass()[i] * s.v()[i];
    return sum;
}

Vec3 center(const core::Simulation& s)
{
    Vec3 sum = Vec3::Zero();
    double mass = 0;
    for (std::size_t i = 0; i < s.x().size(); ++i)
        sum += s.elastic().mass()[i] * s.x()[i], mass += s.elastic().mass()[i];
    return sum / mass;
}

class Finer : public testing::TestWithParam<const char*> {};

/// Linear displacements are exact on both lattices, and so is a box with its faces on planes of voxels.
TEST_P(Finer, AUniformStretchKeepsItsEnergyAndVolume)
{
    const Refined r(bar(), {"solver.integrator=\"static\"", std::string("grid.lattice=\"") + GetParam() + "\""}, 5);
    const auto before = r.wide.simulation.totals(), now = r.fine.simulation.totals();
    ASSERT_GT(before.elasticEnergy, 1);
    EXPECT_NEAR(now.volume, before.volume, 1e-9);
    // The solve leaves residuals of 1e-3 of the forces (solver.newton_tolerance).
    EXPECT_NEAR(now.elasticEnergy, before.elasticEnergy, 1e-6 * before.elasticEnergy);
    EXPECT_EQ(r.fine.simulation.time(), r.wide.simulation.time());
    EXPECT_EQ(r.fine.simulation.steps(), r.wide.simulation.steps());
}
INSTANTIATE_TEST_SUITE_P(OnLattice, Finer, testing::Values("six", "five"));

TEST(Finer, WhatMovesFreelyKeepsItsMomentumAndPlace)
{
    const std::string scene =
        "version = 1\nname = \"ball\"\n[time]\nframes = [1, 12]\nfps = 24\n[grid]\nvoxel_size = 0.1\n[material.m]\n"
        "youngs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n[[body]]\nname = \"b\"\nmaterial = \"m\"\n"
        "shape = { sphere = { radius = 0.5, center = [0.02, 0.01, 0] } }\nvelocity = [1, 2, 0]\n"
        "angular_velocity = [0, 0, 3]\n";
    const Refined r(scene, {}, 5);
    const auto &wide = r.wide.simulation, &fine = r.fine.simulation;
    // Each lattice has its own mass, nearly the sphere's: what matters is the velocity of the whole.
    const double kSame = 5e-3;
    EXPECT_LT((momentum(fine) / fine.volume() - momentum(wide) / wide.volume()).norm(),
              kSame * (momentum(wide) / wide.volume()).norm());
    EXPECT_LT((center(fine) - center(wide)).norm(), kSame * 0.5);
    EXPECT_NEAR(fine.totals().kineticEnergy / wide.totals().kineticEnergy, fine.volume() / wide.volume(), 0.01);
}

TEST(Finer, CracksAndTheirTimesAreThoseOfTheWideLattice)
{
    for (const int frame : {4, 12}) {  // half torn, and in two
        std::vector<std::string> tough = kNotched;
        tough.push_back("fracture.toughness=150");
        Refined r(tearingBar("[output]\nvdb = [\"arrival\"]\n"), tough, frame);
        ASSERT_GT(r.wide.work.countOf("cut", "cells"), 0) << frame;
        const auto before = r.wide.simulation.totals(), now = r.fine.simulation.totals();
        EXPECT_EQ(r.fine.simulation.fragments(), r.wide.simulation.fragments());
        // What the crack took, 4 voxels across: the fine skin beside it has not receded with the wide one.
        const double took = r.wide.simulation.startVolume() - before.volume;
        EXPECT_NEAR(r.fine.simulation.startVolume() - now.volume, took, .2 * took) << frame;
        // The finer lattice sees the tip better: docs/commands.md has what that makes.
        EXPECT_NEAR(now.elasticEnergy, before.elasticEnergy, .15 * before.elasticEnergy + 1e-3) << frame;
        const auto arrivals = [](const SceneRun& run) {
            const core::FrameSource& fracture = *run.simulation.stages().frames.back();
            const auto field = fracture.take(run.simulation.bodies()[0], "arrival");
            const auto& values = std::get<grid::VoxelValues>(field);
            std::map<Coord, float> all;
            for (std::size_t i = 0; i < values.coords.size(); ++i) all[values.coords[i]] = values.scalars[i];
            return all;
        };
        const auto wide = arrivals(r.wide), fine = arrivals(r.fine);
        const auto& phi = r.fine.simulation.bodies()[0].mesh->phi();
        const auto& rest = r.fine.simulation.bodies()[0].mesh->restPhi();
        std::size_t failed = 0;
        phi.forEachBlock([&](Coord block) {
            phi.forEachNode(block, [&](Coord n) {
                failed += rest(n) < 0 && phi(n) >= 0;
                // Never below what the body was, and open where the wide lattice was.
                EXPECT_GE(phi(n), rest(n));
            });
        });
        EXPECT_EQ(fine.size(), failed);
        for (const auto& [voxel, time] : wide)
            if (const auto it = fine.find(2 * voxel); it != fine.end()) {
                EXPECT_EQ(it->second, time);
            }
        EXPECT_GT(fine.size(), 3 * wide.size());
        r.fine.step();
        EXPECT_EQ(r.fine.steps.back().outcome, core::Outcome::converged);
    }
}

/// A narrow notch is no crack: what lies in slivers beside it stays on its own side.
TEST(Finer, HalvesOfANotchedStripThatHavePartedDoNotPullAtEachOther)
{
    std::string strip =
        "version = 1\n[time]\nframes = [1, 60]\n[grid]\nvoxel_size = 0.05\n[material.m]\nyoungs_modulus = 1e5\n"
        "poisson_ratio = 0.3\ndensity = 1000\n[[body]]\nname = \"b\"\nmaterial = \"m\"\n"
        "shape = { box = { size = [0.98, 0.98, 0.38] } }\n"
        "cut = [{ box = { size = [0.6, 0.06, 1], center = [-0.49, 0, 0] } }]\n[fracture]\ntoughness = 100\n";
    for (const char* side : {"", "-"})
        strip += std::string("[[grip]]\nbody = \"b\"\nregion = { halfspace = { normal = [0, ") + side +
                 "1, 0], offset = 0.45 } }\nmove = { velocity = [0, " + side + "0.05, 0] }\n";
    Refined r(strip, {}, 40);
    ASSERT_EQ(r.wide.simulation.fragments(), 2u);
    double most = 0;  // J
    for (const core::StepRecord& step : r.wide.steps) most = std::max(most, step.elasticEnergy);
    const auto before = r.wide.simulation.totals(), now = r.fine.simulation.totals();
    EXPECT_EQ(r.fine.simulation.fragments(), 2u);
    EXPECT_LT(now.elasticEnergy, before.elasticEnergy + 1e-3 * most);
    EXPECT_NEAR(now.kineticEnergy, before.kineticEnergy, .02 * before.kineticEnergy);
}

TEST(Finer, HasTheSameBitsOnAnyNumberOfThreadsAndAfterACheckpoint)
{
    const auto run = [&](int threads) {
        const ThreadLimit limit(threads);
        Refined r(tearingBar("[contact]\n"), kNotched, 8);
        const core::Archive archive = saved(r.fine);
        r.fine.step();
        SceneRun again(tearingBar("[contact]\n"), Refined::finer(kNotched));
        again.simulation.restoreFrom(archive);
        again.step();
        EXPECT_EQ(again.simulation.stateHash(), r.fine.simulation.stateHash());
        return r.fine.simulation.stateHash();
    };
    EXPECT_EQ(run(1), run(3));
}

TEST(Finer, WhatTouchesGoesOnTouching)
{
    Refined r(stack("[contact]\n"), {}, 50);
    ASSERT_GT(r.wide.steps.back().work.countOf("contact", "active"), 0);
    // The gap to the collider is a quarter of a voxel, so all of it falls by half of that, and swings a little farther
    // again, as blocks give way.
    constexpr double kSwing = 1.25;
    const double gap = .25 * (.1 - .05), was = center(r.fine.simulation).y();
    const double released = 1000 * 2 * .125 * 9.81 * gap;
    for (int i = 0; i < 20; ++i) {
        EXPECT_EQ(r.fine.step().outcome, core::Outcome::converged);
        EXPECT_GT(r.fine.steps.back().work.countOf("contact", "active"), 0);
        EXPECT_NEAR(center(r.fine.simulation).y(), was - gap, kSwing * gap);
        EXPECT_LT(r.fine.simulation.totals().kineticEnergy, released);
    }
}

}  // namespace
