// Branches: what may change when a run goes on from a checkpoint of another, and what is carried to a finer lattice.
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/core/branch.h>
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/lab/scenes/scene_run.h>
#include <vdbfrac/scene/reader.h>

#include <gtest/gtest.h>

#include <cmath>
#include <map>

using namespace vdbfrac;
using lab::SceneRun;

namespace {

/// A bar 1 m long that grips pull at its ends, a tenth of a metre a second each.
std::string bar(const std::string& more = "")
{
    std::string s =
        "version = 1\nname = \"bar\"\n[time]\nframes = [1, 12]\nfps = 8\n[grid]\nvoxel_size = 0.1\n[material.m]\n"
        "youngs_modulus = 1e5\npoisson_ratio = 0\ndensity = 1000\n[[body]]\nname = \"b\"\nmaterial = \"m\"\n"
        "shape = { box = { size = [0.4, 1, 0.4] } }\n";
    for (const char* side : {"", "-"})
        s += std::string("[[grip]]\nname = \"") + (*side ? "low" : "high") +
             "\"\nbody = \"b\"\nregion = { box = { size = [1, 0.1, 1], center = [0, " + side +
             "0.5, 0] } }\nmove = { velocity = [0, " + side + "0.1, 0] }\n";
    return s + more;
}

/// Notched and torn by its pull.
std::string tearingBar(const std::string& more = "")
{
    return bar("[damping]\nstiffness = 0.002\n[fracture]\ntoughness = 60\n" + more);
}
const std::vector<std::string> kNotched = {
    "body.0.cut=[{ cylinder = { axis = \"z\", radius = 0.12, center = [0.2, 0.013, 0] } }]",
    "material.m.poisson_ratio=0.3"};

core::Archive saved(const SceneRun& run)
{
    core::Archive archive;
    run.simulation.save(archive);
    return archive;
}

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

/// Two blocks, one on the other, that a floor holds.
std::string stack(const std::string& more)
{
    std::string scene =
        "version = 1\nname = \"pile\"\n[time]\nframes = [1, 60]\nfps = 24\n[grid]\nvoxel_size = 0.1\n[material.m]\n"
        "youngs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n[gravity]\n"
        "[[collider]]\nshape = { halfspace = { normal = [0, -1, 0], offset = 0 } }\n";
    for (const char* y : {"0.3", "0.85"})
        scene += std::string("[[body]]\nname = \"b") + y +
                 "\"\nmaterial = \"m\"\nshape = { box = { size = [0.5, 0.5, 0.5], center = [0, " + y + ", 0] } }\n";
    return scene + more;
}

/// What lies within a gap that comes with the branch stays there: it is not thrown out.
TEST(Branch, AnotherGapThrowsNothing)
{
    SceneRun before(stack("[contact]\n"));
    before.toFrame(30);
    const double calm = before.simulation.totals().kineticEnergy;
    SceneRun branch(stack("[contact]\ngap = 1\n"));
    branch.simulation.branchFrom(saved(before));
    SceneRun again(stack("[contact]\ngap = 1\n"));  // from a checkpoint that the branch starts with
    again.simulation.restoreFrom(saved(branch));
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
    // The gap to the collider is a quarter of a voxel, so all of it falls by half of that, and swings as far again.
    const double gap = .25 * (.1 - .05), was = center(r.fine.simulation).y();
    const double released = 1000 * 2 * .125 * 9.81 * gap;
    for (int i = 0; i < 20; ++i) {
        EXPECT_EQ(r.fine.step().outcome, core::Outcome::converged);
        EXPECT_GT(r.fine.steps.back().work.countOf("contact", "active"), 0);
        EXPECT_NEAR(center(r.fine.simulation).y(), was - gap, 1.1 * gap);
        EXPECT_LT(r.fine.simulation.totals().kineticEnergy, released);
    }
}

}  // namespace
