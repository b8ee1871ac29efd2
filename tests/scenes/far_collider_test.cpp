// Colliders that are far from a body: it makes no samples for them, and has them when they come.
#include "sled.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/core/archive.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

using namespace vdbfrac;
using namespace vdbfrac::test;
using lab::SceneRun;

namespace {

/// A notched bar is pulled.
std::string bar(const std::string& more)
{
    return "version = 1\nname = \"bar\"\n[time]\nframes = [1, 13]\nfps = 24\n[grid]\nvoxel_size = "
           "0.05\n[material.gel]\n"
           "youngs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n"
           "[[body]]\nname = \"bar\"\nmaterial = \"gel\"\nshape = { box = { size = [0.4, 1, 0.4] } }\n"
           "cut = [{ cylinder = { axis = \"z\", radius = 0.12, center = [0.2, 0, 0] } }]\n"
           "[[grip]]\nbody = \"bar\"\nregion = { halfspace = { normal = [0, -1, 0], offset = 0.4 } }\nmove = { "
           "velocity "
           "= [0, -0.8, 0] }\n"
           "[[grip]]\nbody = \"bar\"\nregion = { halfspace = { normal = [0, 1, 0], offset = 0.4 } }\nmove = { velocity "
           "= [0, 0.8, 0] }\n"
           "[damping]\nstiffness = 0.002\n" +
           more;
}
std::string tearingBar(const std::string& more) { return bar("[fracture]\ntoughness = 40\n" + more); }

/// Steps with and without samples for colliders.
struct Looks {
    int with = 0, without = 0;

    explicit Looks(const SceneRun& run)
    {
        for (const core::StepRecord& s : run.steps) ++(s.work.countOf("collider", "samples") > 0 ? with : without);
    }
};

TEST(FarCollider, CostsATearNoSamplesAndNoBit)
{
    SceneRun alone(tearingBar("")),
        far(tearingBar("[[collider]]\nshape = { halfspace = { normal = [0, -1, 0], offset = "
                       "2 } }\n"));
    alone.toEnd(), far.toEnd();
    EXPECT_EQ(far.simulation.stateHash(), alone.simulation.stateHash());
    EXPECT_GT(far.work.countOf("cut", "cells"), 0);
    EXPECT_EQ(Looks(far).with, 0);
}

/// A ball that comes from afar while the bar tears, and strikes its upper half.
const std::string kBall =
    "[[collider]]\nname = \"ball\"\nshape = { sphere = { radius = 0.1, center = [-2, 0.45, 0] } }\n"
    "move = { velocity = [4, 0, 0] }\n";

/// What is made when it comes is what was there all along: a wall so near that samples are there from the beginning
/// touches nothing. Not while it tears: what the cut is off the surface is measured when samples are new.
TEST(FarCollider, ThatComesNearFindsWhatItAlwaysWould)
{
    SceneRun comes(bar(kBall)),
        always(bar(kBall + "[[collider]]\nname = \"wall\"\nshape = { halfspace = { normal = [-1, 0, 0], offset = "
                           "0.35 } }\n"));
    comes.toEnd(), always.toEnd();
    EXPECT_GT(Looks(comes).without, 0);
    EXPECT_GT(Looks(comes).with, 0);
    EXPECT_EQ(Looks(always).without, 0);
    EXPECT_GT(comes.work.countOf("collider", "active"), 0);
    EXPECT_EQ(always.simulation.stateHash(), comes.simulation.stateHash());
}

TEST(FarCollider, RunsGoOnWithTheSameBitsFromFarAndNear)
{
    SceneRun whole(tearingBar(kBall));
    std::vector<std::uint64_t> hashes{whole.simulation.stateHash()};
    while (!whole.atEnd()) whole.step(), hashes.push_back(whole.simulation.stateHash());
    for (std::size_t steps = 0; steps < hashes.size(); steps += std::max<std::size_t>(1, hashes.size() / 7)) {
        core::Archive archive;
        SceneRun first(tearingBar(kBall));
        for (std::size_t i = 0; i < steps; ++i) first.step();
        first.simulation.save(archive);
        const ThreadLimit one(1);
        SceneRun second(tearingBar(kBall));
        second.simulation.restoreFrom(archive);
        for (std::size_t i = steps + 1; i < hashes.size(); ++i) {
            second.step();
            ASSERT_EQ(second.simulation.stateHash(), hashes[i]) << "from " << steps << ", step " << i;
        }
    }
}

/// A grip that stood still presses a block, within a step, onto a floor that nothing was going to reach.
TEST(FarCollider, ThatIsReachedUnforeseenIsTouchedAllTheSame)
{
    constexpr double kLift = .8, kWay = .84, kSunk = .1;  // m, m, voxels
    const auto pressed = [&](const std::string& scheme) {
        return Sled{.gravity = Vec3::Zero(), .lift = kLift, .frames = 3, .solver = "integrator = \"" + scheme + "\"\n"}
                   .text() +
               "[[grip]]\nbody = \"block\"\nregion = { halfspace = { normal = [0, 1, 0], offset = 0.95 } }\n"
               "move = { keys = [{ time = 0 }, { time = 0.0417 }, { time = 0.08, translate = [0, -" +
               number(kWay) + ", 0] }, { time = 1, translate = [0, -" + number(kWay) + ", 0] }] }\n";
    };
    for (const char* scheme : {"backward_euler", "sdirk2"}) {  // the second stage of the latter may set off near it
        SceneRun run(pressed(scheme));
        run.toFrame(2);
        EXPECT_EQ(run.work.countOf("collider", "samples"), 0) << "it was foreseen";
        run.toEnd();
        EXPECT_GT(run.work.countOf("collider", "active"), 0) << scheme;
        EXPECT_LT(run.steps.back().measured.at("collider_depth_m"), kSunk * Sled::kDx) << scheme;
        if (std::string(scheme) != "backward_euler") continue;
        for (const core::StepRecord& s : run.steps) EXPECT_EQ(s.cutbacks, 0);
    }
}

/// A ball that stood still is on the other side of a block a step later: it has gone through, and takes the block
/// along.
TEST(FarCollider, ThatJumpsToTheOtherSideIsNotMissed)
{
    constexpr double kFar = .7, kSpeed = .1;  // m, m/s
    SceneRun run(Sled{.gravity = Vec3::Zero(), .lift = 1, .youngsModulus = 1e7, .frames = 3}.text() +
                 "[[collider]]\nshape = { sphere = { radius = 0.15, center = [-" + number(kFar) + ", 1.1, 0] } }\n" +
                 "move = { keys = [{ time = 0 }, { time = 0.0417 }, { time = 0.0833, translate = [" + number(2 * kFar) +
                 ", 0, 0] }] }\n");
    run.toEnd();
    EXPECT_EQ(run.steps.front().work.countOf("collider", "samples"), 0);
    EXPECT_GT(velocity(run.simulation).x(), kSpeed);
}

}  // namespace
