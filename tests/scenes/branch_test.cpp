// Branches: what may change when a run goes on from a checkpoint of another.
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

using namespace vdbfrac;
using lab::SceneRun;
using namespace test;

namespace {

std::string settings(const std::string& text, const std::vector<std::string>& set)
{
    return scene::writeScene(scene::parseScene(text, "t.toml", effects::vocabulary(), set), effects::vocabulary());
}

TEST(Branch, ChangesAreNamedWithWhatTheyWere)
{
    const auto changed = [&](const std::vector<std::string>& set) {
        return core::branchBetween(settings(tearingBar(), {}), settings(tearingBar(), set)).changes;
    };
    EXPECT_TRUE(changed({}).empty());
    const auto changes = changed({"fracture.toughness=30", "material.m.density=500"});
    ASSERT_EQ(changes.size(), 2u);
    EXPECT_EQ(core::changeText(changes[0]), "material.m.density = 500 (was 1000)");
    EXPECT_EQ(core::changeText(changes[1]), "fracture.toughness = 30 (was 60)");
    const auto added = changed({"contact={}"});
    ASSERT_EQ(added.size(), 1u);
    EXPECT_EQ(added[0].key, "contact");
    EXPECT_TRUE(added[0].before.empty());
    const auto removed =
        core::branchBetween(settings(tearingBar("[contact]\n"), {}), settings(tearingBar(), {})).changes;
    ASSERT_EQ(removed.size(), 1u);
    EXPECT_TRUE(removed[0].after.empty());
}

TEST(Branch, WhatHasToStayIsRefusedByName)
{
    const std::map<std::string, std::string> refused = {
        {"body.0.shape={ box = { size = [0.5, 1, 0.4] } }", "body.0.shape"},
        {"body.0.velocity=[0, 1, 0]", "body.0.velocity"},
        {"grip.0.region={ halfspace = { normal = [0, 1, 0], offset = 0.4 } }", "grip.0.region"},
        {"grid.voxel_size=0.08", "grid.voxel_size"},
        {"grid.voxel_size=0.2", "grid.voxel_size"},
        {"grid.lattice=\"five\"", "grid.lattice"},
        {"time.fps=24", "time.fps"},
        {"time.frames=[3, 12]", "time.frames"},
        {"output.motion=true", "output.motion"},
        {"name=\"other\"", "name"}};
    for (const auto& [set, key] : refused) {
        try {
            (void)core::branchBetween(settings(bar(), {}), settings(bar(), {set}));
            ADD_FAILURE() << set << " was taken";
        } catch (const InputError& e) {
            ASSERT_EQ(e.details().size(), 1u) << e.what();
            EXPECT_EQ(e.details()[0].place, key);
        }
    }
    for (const char* set : {"grip.0.move={ velocity = [0, 0, 0] }", "material.m.youngs_modulus=1", "time.substeps=3",
                            "solver.newton_tolerance=1e-4", "output.obj=false", "gravity={}"})
        EXPECT_EQ(core::branchBetween(settings(bar(), {}), settings(bar(), {set})).changes.size(), 1u) << set;
    EXPECT_TRUE(core::branchBetween(settings(bar(), {}), settings(bar(), {"grid.voxel_size=0.05"})).isFiner);
}

TEST(Branch, AnAddedEffectNotesWhatItFindsThen)
{
    SceneRun run(bar());
    run.toFrame(9);  // 1 s: the upper end is at .6 m
    SceneRun branch(
        bar("[[collider]]\nname = \"lid\"\nshape = { halfspace = { normal = [0, 1, 0], offset = 0.52 } }\n"
            "[[collider]]\nname = \"gone\"\nshape = { box = { size = [0.6, 0.2, 0.6] } }\n"
            "move = { keys = [{ time = 0 }, { time = 1, translate = [3, 0, 0] }] }\n"));
    const auto noted = [&] {
        std::string all;
        for (const std::string& note : branch.simulation.stages().notes)
            if (note.find("deep in collider") != std::string::npos) all += note + "\n";
        return all;
    };
    EXPECT_NE(noted().find("'gone'"), std::string::npos) << noted();
    EXPECT_EQ(noted().find("'lid'"), std::string::npos) << noted();
    branch.simulation.branchFrom(saved(run));
    EXPECT_NE(noted().find("begins up to 0.08"), std::string::npos) << noted();
    EXPECT_NE(noted().find(" m deep in collider 'lid'"), std::string::npos) << noted();
    EXPECT_EQ(noted().find("'gone'"), std::string::npos) << noted();
}

TEST(Branch, AGripGoesOnFromWhereItIsOrIsRefused)
{
    SceneRun run(bar());
    run.toFrame(9);  // 1 s: .1 m
    const core::Archive archive = saved(run);
    SceneRun jumps(bar(), {"grip.0.move={ velocity = [0, 0.2, 0] }"});
    try {
        jumps.simulation.branchFrom(archive);
        ADD_FAILURE() << "a jump of .1 m was taken";
    } catch (const InputError& e) {
        EXPECT_NE(std::string(e.what()).find("would jump by 0.1 m"), std::string::npos) << e.what();
        EXPECT_NE(std::string(e.what()).find("[0, 0.1, 0] m"), std::string::npos) << e.what();
    }
    SceneRun faster(bar(), {"grip.0.move={ keys = [{ time = 0 }, { time = 1, translate = [0, 0.1, 0] }, "
                            "{ time = 1.25, translate = [0, 0.2, 0] }] }"});
    faster.simulation.branchFrom(archive);
    faster.toFrame(11);
    const std::uint32_t node = faster.simulation.gripNodes(0)[0];
    SceneRun rest(bar());
    EXPECT_NEAR(faster.simulation.x()[node].y() - rest.simulation.x()[node].y(), .2, 1e-12);
}

TEST(Branch, StiffnessAndDensityChangeEnergiesByTheirFactors)
{
    SceneRun run(bar());
    run.toFrame(9);
    SceneRun other(bar(), {"material.m.youngs_modulus=2e5", "material.m.density=3000"});
    other.simulation.branchFrom(saved(run));
    EXPECT_EQ(std::vector<Vec3>(other.simulation.x().begin(), other.simulation.x().end()),
              std::vector<Vec3>(run.simulation.x().begin(), run.simulation.x().end()));
    const auto before = run.simulation.totals(), now = other.simulation.totals();
    EXPECT_NEAR(now.elasticEnergy, 2 * before.elasticEnergy, 1e-9 * before.elasticEnergy);
    EXPECT_NEAR(now.kineticEnergy, 3 * before.kineticEnergy, 1e-9 * before.kineticEnergy);
    EXPECT_EQ(other.step().outcome, core::Outcome::converged);
}

/// What a stiffer material holds of energy then has been put in: no step is taken for one that flies apart.
TEST(Branch, StifferExplicitStepsAreSolved)
{
    const std::vector<std::string> scheme = {"solver.integrator=\"symplectic_euler\"", "time.substeps=\"auto\""};
    SceneRun run(bar(), scheme);
    run.toFrame(9);
    std::vector<std::string> stiffer = scheme;
    stiffer.emplace_back("material.m.youngs_modulus=5e7");
    SceneRun other(bar(), stiffer);
    other.simulation.branchFrom(saved(run));
    for (int i = 0; i < 20; ++i) EXPECT_EQ(other.step().outcome, core::Outcome::converged);
}

TEST(Branch, EffectsThatTheRunDidNotHaveBeginAnewAndOthersEnd)
{
    SceneRun run(tearingBar(), kNotched);
    run.toFrame(9);
    ASSERT_GT(run.work.countOf("cut", "cells"), 0);
    const std::string table =
        "[contact]\n[sleep]\nspeed = 0.01\n[[collider]]\nshape = { halfspace = { normal = [0, -1, 0], offset = 2 } }\n";
    SceneRun more(tearingBar(table), kNotched);
    more.simulation.branchFrom(saved(run));
    more.toFrame(10);
    EXPECT_EQ(more.steps.back().outcome, core::Outcome::converged);
    EXPECT_GT(more.work.countOf("contact", "samples"), 0);
    SceneRun fewer(tearingBar(), kNotched);
    fewer.simulation.branchFrom(saved(more));
    fewer.toFrame(11);
    EXPECT_EQ(fewer.work.countOf("contact", "samples"), 0);
    EXPECT_EQ(fewer.steps.back().outcome, core::Outcome::converged);
}

/// What a branch adds is where it would be, had it been there from the start: here it touches after the branch only.
TEST(Branch, CollidersThatMoveAreWhereTheirKeysSay)
{
    constexpr double kSame = 1e-9;  // m, J: where a step begins is a sum of steps
    const std::string scene = bar(
        "[[collider]]\nshape = { sphere = { radius = 0.3 } }\nfriction = 0.5\nmove = { keys = [{ time = 0, translate = "
        "[2, 0, 0] }, { time = 1, translate = [0.6, 0, 0] }, { time = 1.5, translate = [0.3, 0.1, 0] }] }\n");
    SceneRun all(scene), before(bar()), branch(scene);
    before.toFrame(9);
    branch.simulation.branchFrom(saved(before));
    all.toFrame(12), branch.toFrame(12);
    const core::StepRecord &last = all.steps.back(), &also = branch.steps.back();
    EXPECT_GT(last.measured.at("collider_depth_m"), 0.001);
    EXPECT_GT(last.energyFlow.at("collider_work"), 0);
    EXPECT_NEAR(also.measured.at("collider_depth_m"), last.measured.at("collider_depth_m"), kSame);
    for (const auto& [name, joules] : last.energyFlow) EXPECT_NEAR(also.energyFlow.at(name), joules, kSame) << name;
    for (std::size_t i = 0; i < all.simulation.x().size(); ++i)
        EXPECT_LT((branch.simulation.x()[i] - all.simulation.x()[i]).norm(), kSame) << i;
}

/// Bodies that are inside when a collider comes stay as deep; they are not thrown out for what was outside of others.
TEST(Branch, CollidersThatComeOrJumpThrowNothingOut)
{
    const std::string
        floor = "[[collider]]\nname = \"floor\"\nshape = { halfspace = { normal = [1, 0, 0], offset = 9 } }\n",
        ball = "[[collider]]\nname = \"ball\"\nshape = { sphere = { radius = 0.2, center = [",
        added = floor + ball + "0.25, 0, 0] } }\n", far = floor + ball + "5, 0, 0] } }\n";
    SceneRun calm(bar(floor)), aside(bar(far)), alone(bar());
    for (SceneRun* run : {&calm, &aside, &alone}) run->toFrame(3);
    const double before = alone.simulation.totals().kineticEnergy;
    for (const SceneRun* from : {&calm, &aside, &alone}) {
        SceneRun branch(bar(added));
        branch.simulation.branchFrom(saved(*from));
        // A checkpoint that the branch starts with knows it, too.
        SceneRun again(bar(added));
        again.simulation.restoreFrom(saved(branch));
        for (SceneRun* run : {&branch, &again}) {
            const core::StepRecord& step = run->step();
            EXPECT_LT(step.kineticEnergy, 1.5 * before + 1e-3);
            EXPECT_GT(step.measured.at("collider_depth_m"), .1);
        }
        EXPECT_EQ(branch.simulation.stateHash(), again.simulation.stateHash());
    }
}

/// What lies within a gap that comes with the branch stays there: it is not thrown out.
TEST(Branch, AnotherGapThrowsNothing)
{
    SceneRun before(stack("[contact]\n"));
    before.toFrame(30);
    const double calm = before.simulation.totals().kineticEnergy;
    SceneRun branch(stack("[contact]\ngap = 1\n"));
    branch.simulation.branchFrom(saved(before));
    const core::Archive archive = saved(branch);
    EXPECT_NE(archive.get<double>("contact.reach"), saved(before).get<double>("contact.reach"));
    SceneRun again(stack("[contact]\ngap = 1\n"));  // from a checkpoint that the branch starts with
    again.simulation.restoreFrom(archive);
    for (int i = 0; i < 5; ++i) {
        EXPECT_LT(branch.step().kineticEnergy, calm + .1);  // J; thrown it had thousands
        again.step();
        EXPECT_EQ(branch.simulation.stateHash(), again.simulation.stateHash());
    }
}

TEST(Branch, WakesWhatSleeps)
{
    const std::string kRests = "[contact]\n[sleep]\nspeed = 0.02\nafter = 0.1\n[damping]\nstiffness = 0.01\n";
    SceneRun before(stack(kRests));
    while (before.simulation.fragmentsAsleep() < 2 && !before.atEnd()) before.step();
    ASSERT_EQ(before.simulation.fragmentsAsleep(), 2u);
    SceneRun same(stack(kRests)), branch(stack(kRests), {"material.m.density=500"});
    same.simulation.restoreFrom(saved(before));
    branch.simulation.branchFrom(saved(before));
    EXPECT_EQ(same.simulation.fragmentsAsleep(), 2u);
    EXPECT_EQ(branch.simulation.fragmentsAsleep(), 0u);
    branch.step();
    EXPECT_GT(branch.simulation.totals().kineticEnergy, 0);  // half as heavy, it swells
}

}  // namespace
