// Bodies and fragments that touch: how far they stay apart, and what lasts.
#include "two_blocks.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/core/drawing.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

using namespace vdbfrac;
using lab::SceneRun;
using test::blocks;
using test::kDx;
using test::Momentum;
using test::momentumOf;

namespace {

/// How far the lower face of the upper block is above the upper face of the lower one at their middles [m].
double gapOf(const core::Simulation& s)
{
    double top = -1e9, bottom = 1e9;
    for (const core::Body& body : s.bodies()) {
        const tetmesh::EmbeddedSurface surface = body.mesh->surface();
        for (const tetmesh::EmbeddedPoint& p : surface.points) {
            const Vec3 y = p.at(s.x().subspan(body.firstNode));
            if (std::hypot(y.x(), y.z()) > .15) continue;
            if (body.name == "lower") top = std::max(top, y.y());
            if (body.name == "upper") bottom = std::min(bottom, y.y());
        }
    }
    return bottom - top;
}

TEST(Contact, KeepsBlocksApart)
{
    SceneRun run(blocks("[contact]\nfriction = 0\n", "[0, 0.53, 0]"), {"body.1.velocity=[0,-1,0]"});
    double least = 1;
    while (!run.atEnd()) {
        run.step();
        least = std::min(least, gapOf(run.simulation));
    }
    EXPECT_GT(least, -.1 * kDx);
    EXPECT_LT(least, .1 * kDx);
    EXPECT_GT(momentumOf(run.simulation).size, 1);
}

/// At five cells a step nothing is passed: steps are cut back.
TEST(Contact, KeepsFastBlocksApart)
{
    constexpr double kMost = (.2 + .05) * kDx;  // what a step may end with, and how much deeper than that
    SceneRun run(blocks("[contact]\nfriction = 0\n", "[0, 0.7, 0]"),
                 {"body.1.velocity=[0,-6,0]", "time.substeps=1", "time.frames=[1,6]"});
    double least = 1;
    int cut = 0;
    while (!run.atEnd()) {
        cut += run.step().cutbacks;
        least = std::min(least, gapOf(run.simulation));
    }
    EXPECT_GT(cut, 0);
    EXPECT_GT(least, -kMost);
    EXPECT_LT(least, kMost);
}

/// What was tangled when a scene began is left as deep as it was, not thrown out.
TEST(Contact, DoesNotThrowApartWhatBeganTangled)
{
    SceneRun run(blocks("[contact]\n", "[0.1, 0.48, 0.03]"), {"body.1.velocity=[0,0,0]"});
    while (!run.atEnd()) EXPECT_LT(run.step().kineticEnergy, 1e-20);
}

/// A heavy ball crushes a soft block to a quarter, or begins deep in it: cells fold, and samples are in tets in which
/// they were not. What contact holds it was given; thrown out of such tets, the ball got ten times its energy.
TEST(Contact, CrushedMaterialGivesBackNoMoreThanItGot)
{
    const std::string scene =
        "version = 1\nname = \"hit\"\n[time]\nframes = [1, 9]\nfps = 24\n[grid]\nvoxel_size = 0.05\n[gravity]\n"
        "[contact]\n[material.soft]\nyoungs_modulus = 3e4\npoisson_ratio = 0.45\ndensity = 1000\n[material.hard]\n"
        "youngs_modulus = 1e6\npoisson_ratio = 0.45\ndensity = 1200\n[[collider]]\nshape = { halfspace = { normal = "
        "[0, -1, 0] } }\n[[body]]\nname = \"block\"\nmaterial = \"soft\"\nshape = { box = { size = [0.72, 0.33, 0.72], "
        "center = [0, 0.17, 0] } }\n[[body]]\nname = \"ball\"\nmaterial = \"hard\"\nshape = { sphere = { radius = "
        "0.22 } }\n";
    for (const auto& [height, velocity] : {std::pair("0.60", "-3"), std::pair("0.35", "0")}) {
        SceneRun run(scene, {std::string("body.1.shape.sphere.center=[0.05,") + height + ",0]",
                             std::string("body.1.velocity=[0,") + velocity + ",0]"});
        double given = 0, most = 0;
        int cutbacks = 0;
        while (!run.atEnd()) {
            const core::StepRecord& step = run.step();
            given += step.energyFlow.at("contact_work");
            most = std::max(most, step.kineticEnergy + step.elasticEnergy);
            cutbacks += step.cutbacks;
        }
        EXPECT_LT(given, 0.01 * most) << height;
        EXPECT_LT(cutbacks, 5) << height;
    }
}

/// They part about as fast as they are told to, and no faster.
TEST(Contact, PushesApartWhatBeganTangled)
{
    constexpr double kSpeed = .06, kTime = .4, kLeast = .7;  // m/s, s, 1
    SceneRun run(blocks("[contact]\nuntangle_speed = 0.06\n", "[0.1, 0.46, 0.03]"), {"body.1.velocity=[0,0,0]"});
    const double start = gapOf(run.simulation);
    while (run.simulation.time() < kTime) EXPECT_LT(run.step().unnamedShare, 1e-3);
    EXPECT_GT(gapOf(run.simulation) - start, kLeast * kSpeed * run.simulation.time());
    EXPECT_LT(gapOf(run.simulation) - start, kSpeed * run.simulation.time());
    run.toEnd();
    EXPECT_GT(gapOf(run.simulation), -.01 * kDx);
    EXPECT_LT(momentumOf(run.simulation).size, 2 * 125 * kSpeed);
}

/// A block is torn in two, its halves are let back and held where their lips nearly meet.
TEST(Contact, TornLipsMeetAgainWithoutAKickAndPartWithoutBeingGlued)
{
    std::string scene =
        "version = 1\nname = \"released\"\n[time]\nframes = [1, 96]\nfps = 24\n[grid]\nvoxel_size = 0.1\n[[body]]\n"
        "name = \"block\"\nmaterial = \"gel\"\nshape = { box = { size = [1, 1, 1] } }\n"
        "cut = [{ cylinder = { axis = \"z\", radius = 0.2, center = [0.5, 0, 0] } }]\n[material.gel]\n"
        "youngs_modulus = 1e6\npoisson_ratio = 0.3\ndensity = 1000\n[damping]\nstiffness = 0.002\n[contact]\n"
        "[fracture]\ntoughness = 2500\n";
    for (const char* side : {"", "-"}) {
        const std::string s = side, other = s.empty() ? "-" : "";
        scene += "[[grip]]\nbody = \"block\"\nregion = { halfspace = { normal = [0, " + s +
                 "1, 0], offset = 0.45 } }\nmove = { keys = [{ time = 0 }, { time = 0.7, translate = [0, " + s +
                 "0.12, 0] }, { time = 1.4, translate = [0, " + other + "0.1, 0] }, { time = 2.4, translate = [0, " +
                 s + "0.2, 0] }] }\n";
    }
    SceneRun run(scene);
    double released = 0, kinetic = 0, deepest = 0;
    std::int64_t touching = 0;
    while (!run.atEnd()) {
        const core::StepRecord& r = run.step();
        // What the crack let go is the most that a kick could have; what comes back later is the grips' own work.
        if (r.time < .7) released = std::max(released, r.elasticEnergy);
        if (r.time > .75)
            kinetic = std::max(kinetic, r.kineticEnergy), deepest = std::max(deepest, r.measured.at("contact_depth_m"));
        if (r.time > 1.3 && r.time < 1.45) touching += r.work.countOf("contact", "active");
    }
    ASSERT_EQ(run.simulation.fragments(), 2u);
    ASSERT_GT(touching, 0);
    EXPECT_LT(kinetic, .05 * released);
    EXPECT_LT(deepest, .2 * .1);  // of a voxel
    // Pulled apart again, no load is left: nothing is glued.
    EXPECT_LT(run.steps.back().gripLoad[0].norm(), .01 * run.peakLoad(0, 1));
}

/// Crumbs are pushed hard, and turn over. What was pushed out of a tet in a solve is not forgotten, or it comes back
/// deep, unseen; and the energy of a touch does not jump where its tet is crushed, or Newton's method ends there.
TEST(Contact, PiecesOfABrokenSlabStayApart)
{
    for (const char* voxel : {"0.01", "0.0125"}) {
        SceneRun run(readText(std::string(VDBFRAC_SOURCE) + "/data/scenes/cheese.toml"),
                     {std::string("grid.voxel_size=") + voxel});
        core::Drawing drawing(run.scene, run.simulation);
        drawing.follow(run.simulation, run.work);
        EXPECT_EQ(run.work.countOf("draw", "torn_faces"), 0) << "at rest, a plate in which no node lies";
        double deepest = 0;
        int cutbacks = 0;
        while (!run.atEnd()) {
            const core::StepRecord& r = run.step();
            deepest = std::max(deepest, r.measured.at("contact_depth_m") / std::stod(voxel));
            cutbacks += r.cutbacks;
        }
        drawing.follow(run.simulation, run.work);
        EXPECT_GT(run.work.countOf("draw", "cut_faces"), 1000);
        EXPECT_EQ(run.work.countOf("draw", "bridges"), 0) << voxel;
        EXPECT_EQ(run.work.countOf("draw", "defects"), 0) << voxel;
        EXPECT_GE(run.simulation.fragments(), 20u);
        EXPECT_LT(deepest, .2) << voxel;
        EXPECT_GT(deepest, 0) << voxel;
        EXPECT_LT(cutbacks, 20) << voxel;  // an alarm: 3 and 13 of some 200 steps; 670 when lips saw too little
    }
}

TEST(Contact, NamedWithNothingNearChangesNoBit)
{
    const std::string apart = "[0.1, 2, 0.03]";
    SceneRun with(blocks("[contact]\n", apart)), without(blocks("", apart));
    with.toFrame(6), without.toFrame(6);
    EXPECT_EQ(with.simulation.stateHash(), without.simulation.stateHash());
}

/// Nor after a step that a grip has cut short, from which on it looks no farther ahead than for a few of the like.
TEST(Contact, NamedWithNothingNearChangesNoBitAfterAShortStep)
{
    const std::string grip =
        "[[grip]]\nbody = \"lower\"\nregion = { halfspace = { normal = [1, 0, 0], offset = 0.2 } }\n"
        "move = { velocity = [0.02, 0, 0] }\nuntil = 0.0427\n";
    const std::string apart = "[0.1, 2, 0.03]";
    SceneRun with(blocks("[contact]\n" + grip, apart)), without(blocks(grip, apart));
    with.toFrame(6), without.toFrame(6);
    EXPECT_EQ(with.steps.size(), without.steps.size());
    EXPECT_EQ(with.simulation.stateHash(), without.simulation.stateHash());
}

TEST(Contact, LooksForWhatIsNearOnlyWhenNodesHaveMoved)
{
    const auto searches = [](const char* center) {
        SceneRun run(blocks("[contact]\n", center), {"body.upper.velocity=[0,-0.1,0]", "time.substeps=4"});
        run.toFrame(25);
        return run.work.countOf("contact", "searches");
    };
    // .1 m in 96 steps, and lists that last for half a cell.
    const std::int64_t near = searches("[0.1, 0.62, 0.03]"), far = searches("[0.1, 2, 0.03]");
    EXPECT_GE(near, 3);
    EXPECT_LE(near, 10);
    EXPECT_EQ(far, 1) << "of what is within each";
}

/// However two fragments move against each other, what is near within each is looked for only where it deforms: at the
/// start, and once more for a list that lives on.
TEST(Contact, LooksWithinFragmentsOnlyWhereTheyDeform)
{
    SceneRun run(blocks("[contact]\n", "[0.1, 2, 0.03]"), {"body.upper.velocity=[0,20,0]", "time.substeps=4"});
    run.toFrame(13);
    EXPECT_GE(run.work.countOf("contact", "searches"), 1);
    EXPECT_LE(run.work.countOf("contact", "searches"), 4);
}

/// The midpoint rule knows the end of a step only by extrapolation, and friction remembers where things stuck there.
TEST(Contact, RefusesFrictionUnderTheMidpointRule)
{
    const auto refusal = [](const std::string& tables) {
        std::string scene = blocks(tables);
        scene.insert(scene.find("[solver]\n") + 9, "integrator = \"midpoint\"\n");
        try {
            SceneRun run(scene);
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    const std::string floor = "[[collider]]\nshape = { halfspace = { normal = [0, -1, 0], offset = 1 } }\n";
    for (const std::string& tables : {std::string("[contact]\n"), floor}) {
        EXPECT_NE(refusal(tables).find("sdirk2"), std::string::npos) << tables;
        EXPECT_NE(refusal(tables).find(".friction"), std::string::npos) << tables;
        EXPECT_EQ(refusal(tables + "friction = 0\n"), "") << tables;
    }
}

}  // namespace
