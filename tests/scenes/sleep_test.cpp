// Fragments that lie still fall asleep: they cost nothing, stay where they are, and wake when something pushes them.
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/lab/scenes/saw.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

using namespace vdbfrac;
using lab::SceneRun;

namespace {

constexpr double kH = 0.05;  // m

const std::string kFloor = "[gravity]\n[[collider]]\nshape = { halfspace = { normal = [0, -1, 0] } }\n";

std::string scene(const std::string& bodies, const std::string& more)
{
    return "version = 1\nname = \"rest\"\n[time]\nframes = [1, 97]\n[grid]\nvoxel_size = 0.05\n"
           "[material.gel]\nyoungs_modulus = 1e6\npoisson_ratio = 0.3\ndensity = 1000\n" +
           bodies + more;
}

std::string block(const std::string& name, const std::string& center, const std::string& more = "")
{
    return "[[body]]\nname = \"" + name +
           "\"\nmaterial = \"gel\"\nshape = { box = { size = [0.31, 0.31, 0.31], center = " + center + " } }\n" + more;
}

/// A slab that cuts divide into n x n pieces of three cells, a little above the floor.
std::string tiles(int n)
{
    const double step = .3, size = n * step;
    const std::string wide = std::to_string(size + 1);
    std::string cuts;
    for (int i = 1; i < n; ++i) {
        const std::string at = std::to_string(i * step - size / 2 + .01);
        cuts += "{ box = { size = [0.12, 1, " + wide + "], center = [" + at + ", 0, 0] } },\n";
        cuts += "{ box = { size = [" + wide + ", 1, 0.12], center = [0, 0, " + at + "] } },\n";
    }
    const std::string edge = std::to_string(size);
    return "[[body]]\nname = \"tiles\"\nmaterial = \"gel\"\nshape = { box = { size = [" + edge + ", 0.16, " + edge +
           "], center = [0.01, 0.1, 0.01] } }\ncut = [" + cuts + "]\n";
}

double asleep(const core::StepRecord& r) { return r.measured.at("asleep"); }

/// Runs until that many fragments are asleep.
const core::StepRecord& untilAsleep(SceneRun& run, double count)
{
    while (!run.atEnd() && (run.steps.empty() || asleep(run.steps.back()) < count)) run.step();
    return run.steps.back();
}

TEST(Sleep, HundredPiecesAtRestAreNotEvaluated)
{
    SceneRun run(scene(tiles(10), kFloor + "[contact]\n[sleep]\n"));
    ASSERT_EQ(asleep(untilAsleep(run, 100)), 100);
    EXPECT_GE(run.simulation.time(), .5);
    run.step();  // in which their energy is taken once
    const std::vector<Vec3> x(run.simulation.x().begin(), run.simulation.x().end());
    for (int i = 0; i < 3; ++i) {
        const core::StepRecord& r = run.step();
        EXPECT_EQ(r.work.countOf("solve", "evaluated_tets"), 0);
        EXPECT_EQ(r.work.countOf("solve", "product_tets"), 0);
        EXPECT_EQ(r.kineticEnergy, 0);
        EXPECT_GT(r.elasticEnergy, 0);
        EXPECT_EQ(asleep(r), 100);
    }
    EXPECT_TRUE(std::equal(x.begin(), x.end(), run.simulation.x().begin()));
}

/// A node of thin cut tets may tremble; one that weighs as much as others, and moves as fast, keeps its fragment awake.
TEST(Sleep, IsNotKeptOffByWhatWeighsNextToNothing)
{
    constexpr double kSpeed = .01, kAfter = .5, kFast = 3;  // m/s, s, of the speed
    const auto sleepsWhile = [&](bool isHeavy) {
        SceneRun run(scene(block("a", "[0.013, 1, 0.007]"), "[sleep]\nspeed = 0.01\n"));
        const core::Simulation& s = run.simulation;
        const std::span<const double> mass = s.elastic().mass();
        const auto [lightest, heaviest] = std::ranges::minmax_element(mass);
        EXPECT_LT(*lightest * kFast * kFast, .5 * *heaviest);
        std::vector<Vec3> v(mass.size(), Vec3::Zero());
        v[std::size_t((isHeavy ? heaviest : lightest) - mass.begin())] = {0, kFast * kSpeed, 0};
        const std::vector<std::uint8_t> held(1, 0);
        core::SleepContext context;
        context.x = s.x(), context.dt = 2 * kAfter, context.bodies = s.bodies(), context.v = v, context.mass = mass;
        context.held = held, context.converged = true;
        std::vector<std::uint8_t> asleep(1, 0);
        s.stages().sleep.at(0)->decide(context, asleep);
        return asleep[0] == 1;
    };
    EXPECT_TRUE(sleepsWhile(false));
    EXPECT_FALSE(sleepsWhile(true));
}

/// Of a block that lies, no more than what the speed limit says is lost, and it is in the accounts.
TEST(Sleep, TakesOnlyTheEnergyOfSlowMotion)
{
    const double limit = .01 * std::sqrt(9.81 * kH), mass = 1000 * .31 * .31 * .31;
    SceneRun run(scene(block("a", "[0, 0.2, 0]"), kFloor + "[sleep]\n"));
    const core::StepRecord& r = untilAsleep(run, 1);
    ASSERT_EQ(asleep(r), 1);
    EXPECT_GE(r.energyFlow.at("sleep_dissipated"), 0);
    EXPECT_LE(r.energyFlow.at("sleep_dissipated"), .5 * mass * limit * limit);
    EXPECT_LT(run.steps.back().unnamedShare, .01);
}

/// Asleep and awake agree.
TEST(Sleep, LeavesPiecesWhereTheyWouldLie)
{
    constexpr double kApart = .01;  // cells
    const std::string bodies = block("a", "[0, 0.17, 0]") + block("b", "[0.02, 0.5, 0.01]");
    SceneRun with(scene(bodies, kFloor + "[contact]\n[sleep]\n")), without(scene(bodies, kFloor + "[contact]\n"));
    with.toFrame(60), without.toFrame(60);
    EXPECT_EQ(asleep(with.steps.back()), 2);
    for (std::size_t i = 0; i < with.simulation.x().size(); ++i)
        ASSERT_LT((with.simulation.x()[i] - without.simulation.x()[i]).norm(), kApart * kH);
}

/// Six blocks that fall into a pile of three layers: it comes to rest without jitter,
/// and with sleep all of it sleeps.
TEST(Sleep, PilesComeToRest)
{
    std::string pile;
    for (int layer = 0; layer < 3; ++layer)
        for (int i = 0; i < 3 - layer; ++i)
            pile += block(std::string(1, char('a' + layer)) + std::to_string(i),
                          "[" + std::to_string((i - .5 * (2 - layer)) * .4 + .013 * layer) + ", " +
                              std::to_string(.2 + .4 * layer) + ", " + std::to_string(.011 * (i + layer)) + "]");
    SceneRun awake(scene(pile, kFloor + "[contact]\nfriction = 0.5\n")),
        sleeping(scene(pile, kFloor + "[contact]\nfriction = 0.5\n[sleep]\n"));
    constexpr double kJitter = 1e-6;  // of the energy that they fall with; a hundredth of it was measured
    double fastest = 0, most = 0;
    while (!awake.atEnd()) {
        const core::StepRecord& r = awake.step();
        fastest = std::max(fastest, r.kineticEnergy);
        if (r.time > 2.5) most = std::max(most, r.kineticEnergy);
    }
    EXPECT_LT(most, kJitter * fastest);
    EXPECT_EQ(asleep(untilAsleep(sleeping, 6)), 6);
}

/// A block and one far from it, on the floor, and a ball that falls on the first.
std::string ballOnBlock()
{
    const std::string ball =
        "[[body]]\nname = \"ball\"\nmaterial = \"gel\"\nshape = { sphere = { radius = 0.15, center = [0.02, 4, 0] } "
        "}\n";
    return scene(block("a", "[0, 0.16, 0]") + block("far", "[2, 0.16, 0]") + ball, kFloor + "[contact]\n[sleep]\n");
}

/// What falls on a sleeping piece wakes it, and no other.
TEST(Sleep, EndsWithAPush)
{
    SceneRun run(ballOnBlock());
    ASSERT_EQ(asleep(untilAsleep(run, 2)), 2);
    const std::size_t far = run.simulation.bodies()[1].firstNode;
    const Vec3 lies = run.simulation.x()[far];
    double fastest = 0;
    while (!run.atEnd() && asleep(run.steps.back()) == 2) run.step();
    EXPECT_EQ(asleep(run.steps.back()), 1);
    EXPECT_LT(run.simulation.time(), 1.2);
    run.step();
    for (std::size_t i = 0; i < run.simulation.bodies()[0].mesh->nodeCount(); ++i)
        fastest = std::max(fastest, run.simulation.v()[i].norm());
    EXPECT_GT(fastest, .1);
    EXPECT_EQ(run.simulation.x()[far], lies);
}

/// It is no wall in the step that strikes it: but for what is too little to wake it, what strikes gives what it loses.
TEST(Sleep, EndsInTheStepOfAPush)
{
    constexpr double kSpeed = 0.05, kLost = 0.01;  // m/s; of what would bring the piece to that speed
    const std::string thrown = block("thrown", "[-0.7, 0.02, 0.03]", "velocity = [3, 0, 0]\n");
    SceneRun run(scene(block("lies", "[0, 0, 0]") + thrown, "[contact]\nfriction = 0\n[sleep]\n"),
                 {"sleep.after=0.05", "sleep.speed=" + std::to_string(kSpeed)});
    const auto momentum = [&] {
        Vec3 sum = Vec3::Zero();
        for (std::size_t i = 0; i < run.simulation.v().size(); ++i)
            sum += run.simulation.elastic().mass()[i] * run.simulation.v()[i];
        return sum;
    };
    const Vec3 before = momentum();
    const double lost = kLost * kSpeed * before.norm() / 3;
    ASSERT_EQ(asleep(untilAsleep(run, 1)), 1);
    while (run.simulation.time() < 0.3) {
        run.step();
        EXPECT_LT((momentum() - before).norm(), lost) << run.simulation.time();
    }
    EXPECT_EQ(asleep(run.steps.back()), 0);
}

/// Whatever is struck goes along, also where it fell asleep a step before: what a block has of energy when it shares
/// its momentum is the least that is left.
TEST(Sleep, EndsWithAPushInItsFirstStep)
{
    constexpr double kLost = .02;  // what a block may lose in the step in which it meets one that sleeps
    const double first = .6 * .6 * .6 * 1000, second = .4 * .4 * .4 * 1000,
                 left = .5 * second * second / (first + second);
    for (const char* x : {"-0.60", "-0.645", "-0.69"}) {
        SceneRun run(
            "version = 1\nname = \"hit\"\n[time]\nframes = [1, 12]\nfps = 24\nsubsteps = 1\n"
            "[grid]\nvoxel_size = 0.1\n[material.gel]\nyoungs_modulus = 1e7\npoisson_ratio = 0.3\n"
            "density = 1000\n[[body]]\nname = \"a\"\nmaterial = \"gel\"\n"
            "shape = { box = { size = [0.6, 0.6, 0.6] } }\n[[body]]\nname = \"b\"\nmaterial = \"gel\"\n"
            "velocity = [1, 0, 0]\nshape = { box = { size = [0.4, 0.4, 0.4], center = [" +
            std::string(x) + ", 0, 0] } }\n[contact]\n[sleep]\nspeed = 0.01\nafter = 0.1\n");
        run.toEnd();
        EXPECT_GT(run.simulation.totals().kineticEnergy, (1 - kLost) * left) << x;
    }
}

TEST(Sleep, GoesOnAfterAResumeToTheBit)
{
    const std::vector<std::string> short_{"time.frames=[1,30]"};
    SceneRun whole(ballOnBlock(), short_);
    std::vector<std::uint64_t> expected;
    while (!whole.atEnd()) whole.step(), expected.push_back(whole.simulation.stateHash());
    std::size_t first = 0;  // step after which some sleep
    while (asleep(whole.steps[first]) == 0) ++first;
    for (const std::size_t steps : {first - 3, first + 1, first + 2}) {
        core::Archive archive;
        {
            SceneRun before(ballOnBlock(), short_);
            for (std::size_t i = 0; i < steps; ++i) before.step();
            before.simulation.save(archive);
        }
        const ThreadLimit one(1);
        SceneRun after(ballOnBlock(), short_);
        after.simulation.restoreFrom(archive);
        for (std::size_t i = steps; i < expected.size(); ++i) {
            const core::StepRecord& r = after.step();
            ASSERT_EQ(after.simulation.stateHash(), expected[i]) << steps << ", " << i;
            ASSERT_EQ(r.elasticEnergy, whole.steps[i].elasticEnergy);
            ASSERT_EQ(asleep(r), asleep(whole.steps[i]));
        }
    }
    EXPECT_EQ(asleep(whole.steps[first + 2]), 2);
}

TEST(Sleep, EndsWhenTheGroundGoes)
{
    SceneRun run(
        scene(block("a", "[0, 0.16, 0]"),
              "[gravity]\n[[collider]]\nshape = { box = { size = [1, 0.4, 1], center = [0, -0.2, 0] } }\n"
              "move = { keys = [{ time = 0 }, { time = 1.5 }, { time = 1.6, translate = [0, -3, 0] }] }\n[sleep]\n"));
    ASSERT_EQ(asleep(untilAsleep(run, 1)), 1);
    EXPECT_LT(run.simulation.time(), 1.5);
    while (run.simulation.time() < 1.7) run.step();
    EXPECT_EQ(asleep(run.steps.back()), 0);
    EXPECT_LT(run.simulation.v()[0].y(), -.3);
}

/// A piece that is cut again wakes, and no other, though nothing pushes it; it falls asleep again as two.
TEST(Sleep, EndsWithACut)
{
    lab::Saw saw(.01, .04, 1.5);
    SceneRun run(scene(block("a", "[0, 0.16, 0]") + block("far", "[2, 0.16, 0]"), "[sleep]\nspeed = 0.01\n"), {}, &saw);
    ASSERT_EQ(asleep(untilAsleep(run, 2)), 2);
    while (!run.atEnd() && run.simulation.fragments() == 2) run.step();
    EXPECT_NEAR(run.simulation.time(), 1.5, .05);
    EXPECT_EQ(asleep(run.step()), 1);
    EXPECT_GT(run.steps.back().work.countOf("solve", "evaluated_tets"), 0);
    EXPECT_EQ(asleep(untilAsleep(run, 3)), 3);
}

/// What keys of time make weaker wakes up and tears.
TEST(Sleep, EndsWhereMaterialGetsWeaker)
{
    const std::string keys = "keys = [{ time = 1.5, scale = 1 }, { time = 1.6, scale = 1e-5 }]\n";
    SceneRun run(
        scene(block("a", "[0, 0.16, 0]"), kFloor + "[sleep]\n[fracture]\nkappa = 1e4\ndriver = \"full\"\n" + keys));
    ASSERT_EQ(asleep(untilAsleep(run, 1)), 1);
    while (run.simulation.time() < 1.49) EXPECT_EQ(asleep(run.step()), 1);
    while (run.simulation.time() < 1.7) run.step();
    EXPECT_LT(run.steps.back().volume, .9 * run.simulation.startVolume());
}

TEST(Sleep, NamedWhereNothingRestsChangesNoBit)
{
    const std::string fall = block("a", "[0, 40, 0]");
    SceneRun with(scene(fall, kFloor + "[sleep]\n")), without(scene(fall, kFloor));
    with.toFrame(30), without.toFrame(30);
    EXPECT_EQ(with.simulation.stateHash(), without.simulation.stateHash());
}

/// Where there is nothing to tell a speed by, or nothing moves.
TEST(Sleep, RefusesScenesThatItHasNoMeaningIn)
{
    const auto refusal = [](const std::string& tables, const std::string& solver) {
        try {
            SceneRun run("version = 1\nname = \"s\"\n[time]\nframes = [1, 2]\n[grid]\nvoxel_size = 0.1\n[solver]\n" +
                         solver +
                         "[[body]]\nname = \"b\"\nmaterial = \"m\"\nshape = { box = { size = [0.4, 0.4, 0.4] } }\n"
                         "[material.m]\nyoungs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n" +
                         tables);
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_NE(refusal("[sleep]\n", "").find("add speed"), std::string::npos);
    EXPECT_NE(refusal("[sleep]\n[gravity]\n", "integrator = \"static\"\n").find("static"), std::string::npos);
    EXPECT_EQ(refusal("[sleep]\nspeed = 0.01\n", ""), "");
}

}  // namespace
