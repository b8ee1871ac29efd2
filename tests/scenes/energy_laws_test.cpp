// Where the energy of each step came from and went: the columns of stats.csv that end in _J, by their laws.
#include "branching_scenes.h"

#include <vdbfrac/lab/scenes/rod.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

using namespace vdbfrac;
using lab::SceneRun;

namespace {

constexpr double kSolved = 1e-7;  // relative: what the Newton tolerance of these scenes leaves open

std::string block(const std::string& solver, const std::string& body, const std::string& more)
{
    return "version = 1\ntime = { frames = [1, 100], fps = 100, substeps = 1 }\ngrid.voxel_size = 0.1\n"
           "solver = { newton_tolerance = 1e-10, linear_tolerance = 1e-6, " +
           solver + " }\n[[body]]\nname = \"block\"\nshape = { box = { size = [0.4, 0.4, 0.8] } }\nmaterial = \"m\"\n" +
           body + "\n[material.m]\nyoungs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n" + more;
}

const std::string kBackward = "integrator = \"backward_euler\"", kMidpoint = "integrator = \"midpoint\"";

std::string grip(const std::string& region, const std::string& move)
{
    return "[[grip]]\nname = \"hand\"\nbody = \"block\"\nregion = { halfspace = { normal = [0, 0, 1], offset = " +
           region + " } }\nmove = { " + move + " }\n";
}

double total(const SceneRun& run, const std::string& flow)
{
    double sum = 0;
    for (const core::StepRecord& step : run.steps)
        if (const auto it = step.energyFlow.find(flow); it != step.energyFlow.end()) sum += it->second;
    return sum;
}

double mass(const SceneRun& run)
{
    double sum = 0;
    for (double m : run.simulation.elastic().mass()) sum += m;
    return sum;
}

/// A weight that falls from rest for n steps of dt has v = n g dt, and fell by the sum of v dt: what gravity put in
/// less what it has, m g^2 dt^2 n / 2, is the integrator's.
TEST(EnergyFlows, OfAFallAreWeightTimesHeightAndHalfAStepOfIt)
{
    SceneRun run(block(kBackward, "", "[gravity]\nacceleration = [0, 0, -10]\n"));
    run.toFrame(21);
    constexpr double g = 10, dt = 0.01, n = 20;
    const double fell = g * dt * dt * n * (n + 1) / 2, m = mass(run);
    EXPECT_NEAR(total(run, "gravity_work"), m * g * fell, kSolved * m * g * fell);
    EXPECT_NEAR(total(run, "integrator"), m * g * g * dt * dt * n / 2, kSolved * m * g * fell);
    EXPECT_FALSE(run.steps[0].energyFlow.contains("gravity_dissipated"));
    EXPECT_FALSE(run.steps[0].energyFlow.contains("removed"));
}

/// A body that spins and rings: the midpoint rule keeps its energy but for terms of third order; backward Euler takes
/// some.
TEST(EnergyFlows, MidpointTakesNextToNothingWhereBackwardEulerTakesMuch)
{
    const std::string spin = "angular_velocity = [0, 3, 0]";
    SceneRun keeps(block(kMidpoint, spin, "")), takes(block(kBackward, spin, ""));
    keeps.toFrame(21), takes.toFrame(21);
    const double first = takes.steps[0].kineticEnergy + takes.steps[0].elasticEnergy + total(takes, "integrator");
    EXPECT_GT(total(takes, "integrator"), 0.02 * first);
    EXPECT_LT(std::abs(total(keeps, "integrator")), 0.01 * total(takes, "integrator"));
}

/// Slow load on a held block: what the hands put in is what the block stores.
TEST(EnergyFlows, WorkOfASlowPullIsTheEnergyStored)
{
    const std::string hold =
        "[[grip]]\nbody = \"block\"\nregion = { halfspace = { normal = [0, 0, -1], offset = 0.3 } }\n"
        "move = { velocity = [0, 0, 0] }\n";
    // The mean of the loads at both ends of a step is right where they are linear in the way; of 20 steps this is left.
    constexpr double kTrapezoid = 2e-4;
    for (const char* move : {"velocity = [0, 0, 0.2]", "keys = [{ time = 0 }, { time = 1, rotate = [0, 0, 60] }]",
                             "keys = [{ time = 0 }, { time = 1, rotate = [40, 0, 0], translate = [0, 0, 0.05] }]",
                             "force = [30, 0, 100], ramp = 0.2"}) {
        SceneRun run(block("integrator = \"static\"", "", hold + grip("0.3", move)));
        run.toFrame(21);
        const double stored = run.steps.back().elasticEnergy;
        EXPECT_GT(stored, 0.1) << move;
        EXPECT_NEAR(total(run, "work_hand"), stored, kTrapezoid * stored) << move;
    }
}

/// What damping takes of a body in free fall is a m v^2 dt.
TEST(EnergyFlows, DampingTakesItsForceAlongTheWay)
{
    SceneRun run(block(kBackward, "velocity = [3, 0, 0]", "[damping]\nmass = 2\n"));
    run.step();
    const double v = 3 / (1 + 2 * 0.01), expected = 2 * mass(run) * v * v * 0.01;
    EXPECT_NEAR(total(run, "damping_dissipated"), expected, kSolved * expected);
}

struct Accounted {
    const char* integrator;
    int substeps;
    double limit;  // of the work put in: what may have no account
};
// Newton's tolerance leaves no more; in static steps the quadrature of the work does.
constexpr Accounted kAccounted[] = {{"backward_euler", 1, 1e-6},   {"midpoint", 1, 1e-6},      {"sdirk2", 1, 1e-6},
                                    {"symplectic_euler", 8, 1e-6}, {"forward_euler", 8, 1e-6}, {"static", 1, 1e-3}};

/// A block under all that does work: it flies, is turned, dragged, pulled, has weight, is damped. Grips overlap.
std::string busyBlock(const char* integrator, const std::string& more)
{
    const auto region = [](const std::string& name, double z, double offset) {
        return "[[grip]]\nname = \"" + name + "\"\nbody = \"block\"\nregion = { halfspace = { normal = [0, 0, " +
               std::to_string(z) + "], offset = " + std::to_string(offset) + " } }\nmove = ";
    };
    return block(std::string("integrator = \"") + integrator + "\"", "velocity = [0.3, 0, 0]",
                 region("turned", -1, .3) + "{ keys = [{ time = 0 }, { time = 1, rotate = [0, 0, 90] }] }\n" +
                     region("dragged", -1, .4) + "{ velocity = [0.2, 0, -0.1] }\n" + region("pulled", 1, .3) +
                     "{ force = [100, 0, 900], ramp = 0.05 }\n" + region("weighed", 1, .35) +
                     "{ force = [0, 40, 0] }\n" +
                     "[gravity]\nacceleration = [0, 0, -9.81]\n[damping]\nmass = 2\nstiffness = 1e-4\n" + more);
}

/// All accounts are so large that the ledger would show it if one of them were missing.
void expectWeight(const SceneRun& run, const Accounted& a)
{
    const char* const works[] = {"work_turned", "work_dragged", "work_pulled", "work_weighed", "gravity_work"};
    double putIn = 0;
    for (const char* name : works) putIn += std::abs(total(run, name));
    const double seen = 2 * a.limit * putIn;
    for (const char* name : works) EXPECT_GT(std::abs(total(run, name)), seen) << name;
    EXPECT_GT(std::abs(total(run, "integrator")), seen);
    if (std::string(a.integrator) != "static") {
        EXPECT_GT(total(run, "damping_dissipated"), seen);
    }
    if (run.work.countOf("cut", "voxels") > 0) {
        EXPECT_GT(total(run, "removed"), seen);
    }
}

TEST(EnergyAccounts, NameAllEnergyOfEachStepAlsoOfATear)
{
    for (const Accounted& a : kAccounted)
        for (const char* more : {"", "[fracture]\nkappa = 5\n"}) {
            SCOPED_TRACE(a.integrator + std::string(" ") + more);
            SceneRun run(busyBlock(a.integrator, more), {"time.substeps=" + std::to_string(a.substeps)});
            run.toFrame(16);
            double most = 0;
            for (const core::StepRecord& step : run.steps) most = std::max(most, step.unnamedShare);
            std::printf("%s%s: %.2e without account\n", a.integrator, *more ? ", torn" : "", most);
            EXPECT_LT(most, a.limit);
            EXPECT_EQ(run.work.countOf("cut", "voxels") > 0, *more != 0);
            expectWeight(run, a);
        }
}

/// Forces that a loose tolerance leaves out of balance do work that no account has: the record says so.
/// What moves as a whole takes no work but rounding: that needs no account, and gives no alarm.
TEST(EnergyFlows, OfRigidMotionsAreNone)
{
    SceneRun run(block("integrator = \"static\"", "", grip("0.3", "velocity = [0.1, 0, 0]")),
                 {"solver.newton_tolerance=1e-3", "solver.linear_tolerance=1e-2"});
    run.toFrame(21);
    for (const core::StepRecord& step : run.steps) EXPECT_LT(step.unnamedShare, core::kMaxUnnamedShare) << step.time;
}

/// A press that moves stands elsewhere along a step than at its end: what it does in a step out of balance is what it
/// tells of itself, and no more than that comes to rest.
TEST(EnergyFlows, OfStaticStepsUnderAPressAddUp)
{
    constexpr double kLeft = 1e-3;  // of the work: means of the forces at both ends leave as much
    SceneRun run(block(
        "integrator = \"static\"", "",
        "[[grip]]\nname = \"hand\"\nbody = \"block\"\nregion = { halfspace = { normal = [0, 0, -1], offset = 0.3 } }\n"
        "move = { velocity = [0, 0, 0] }\n[[collider]]\nname = \"press\"\nfriction = 0\nshape = { sphere = { radius = "
        "0.3, "
        "center = [0, 0, 0.69] } }\nmove = { velocity = [0, 0, -0.5] }\n"));
    const core::StepRecord& first = run.step();  // not yet in balance
    const double work = first.energyFlow.at("collider_work");
    EXPECT_GT(work, 0);
    EXPECT_LT(std::abs(first.energyFlow.at("integrator")), work);
    EXPECT_LT(std::abs(first.energyFlow.at("unnamed")), kLeft * work);
    run.toFrame(11);
    EXPECT_LT(std::abs(total(run, "unnamed")), kLeft * total(run, "collider_work"));
}

TEST(EnergyFlows, OfStepsThatAreHardlySolvedAreToldToMiss)
{
    SceneRun run(block(kBackward, "", "[gravity]\nacceleration = [0, 0, -10]\n" + grip("0.3", "velocity = [0, 0, 0]")),
                 {"solver.newton_tolerance=0.9"});
    run.toFrame(11);
    EXPECT_GT(run.steps.back().unnamedShare, core::kMaxUnnamedShare);
}

/// A rod that tears under a load that stays loses what the material held that went: what a run that goes on from the
/// same state, and does not tear, finds in the step, less a fresh sum over what is left.
TEST(EnergyFlows, RemovedIsWhatTheMaterialHeldThatIsGone)
{
    lab::Rod rod;
    SceneRun run(rod.text("[fracture]\nkappa = 1\n"));
    double largest = 0, removed = 0;
    for (int step = 0; step < 20; ++step) {
        SceneRun whole(rod.text(""));
        whole.simulation.branchFrom(test::saved(run));
        const core::StepRecord& record = run.step();
        const double solved = whole.step().elasticEnergy,
                     now = run.simulation.elastic().evaluate(run.simulation.x(), {}, nullptr);
        largest = std::max(largest, solved);
        EXPECT_NEAR(record.elasticEnergy, now, 1e-9 * largest) << step;
        EXPECT_NEAR(record.energyFlow.at("removed"), solved - now, 1e-9 * largest) << step;
        removed += solved - now;
    }
    EXPECT_GT(removed, .05 * largest);
}

}  // namespace
