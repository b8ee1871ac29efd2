// Where the energy of each step came from and went: the columns of stats.csv that end in _J, by their laws.
#include <vdbfrac/lab/scenes/rod.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <gtest/gtest.h>

#include <cmath>
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

/// A rod that tears under a load that stays loses what the material held that went: all that a fresh sum over it finds.
TEST(EnergyFlows, RemovedIsWhatTheMaterialHeldThatIsGone)
{
    lab::Rod rod;
    SceneRun run(rod.text("[fracture]\nkappa = 1\n"));
    double before = 0, removed = 0;
    for (int step = 0; step < 20; ++step) {
        const core::StepRecord& record = run.step();
        const double now = run.simulation.elastic().evaluate(run.simulation.x(), {}, nullptr);
        EXPECT_NEAR(record.elasticEnergy, now, 1e-9 * std::max(before, now)) << step;
        removed += record.energyFlow.at("removed");
        before = std::max(before, now);
    }
    EXPECT_GT(removed, 0);
}

}  // namespace
