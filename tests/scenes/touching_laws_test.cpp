// Laws of touches: forces are those of the energy and cancel, momentum stays, energy does not grow.
#include "potential_differences.h"
#include "two_blocks.h"

#include <vdbfrac/lab/scenes/scene_run.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

using namespace vdbfrac;
using lab::SceneRun;
using test::blocks;
using test::Momentum;
using test::momentumOf;
using test::sum;

namespace {

class OnLattice : public testing::TestWithParam<const char*> {};

TEST_P(OnLattice, ForcesAreThoseOfTheEnergyAndCancel)
{
    constexpr double kStep = 1e-7, kError = 1e-4;  // m; of differences, and of weights kept as floats
    constexpr double kRounding = 1e-12;
    SceneRun run(blocks("[contact]\n", "[0.1, 0.54, 0.03]", GetParam()));
    run.toFrame(4);
    const core::Simulation& s = run.simulation;
    solver::Potential& potential = *s.stages().solve.back();
    potential.begin({s.x(), s.v(), 1. / 24, s.elastic(), s.time() + 1. / 24});
    std::mt19937 random(3);
    std::uniform_real_distribution<double> any(-1, 1);
    std::vector<Vec3> u(s.x().size()), x = sum(s.x(), 1. / 96, s.v());
    for (Vec3& v : u) v = Vec3(any(random), any(random), any(random));
    const test::PotentialAlong along = test::potentialAlong(potential, x, u, kStep);
    ASSERT_GT(along.energy, 0);
    const std::vector<Vec3>& gradient = along.gradient;
    double forces = 0;
    Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
    for (std::size_t i = 0; i < x.size(); ++i) {
        forces += gradient[i].norm();
        force += gradient[i], moment += x[i].cross(gradient[i]);
    }
    EXPECT_NEAR(along.slopeOfEnergy, along.slope, kError * forces);
    // Friction holds on to the start of the step, so only contact has no moment.
    EXPECT_LT(force.norm(), kRounding * forces);
    for (const solver::Coupling& c : along.couplings) EXPECT_FALSE(c.isExternal());
    // What is left out of the tangent is smaller by the depth over a cell.
    constexpr double kLeftOut = 0.1;
    EXPECT_NEAR(along.tangent, along.tangentOfGradient, kLeftOut * along.tangent);
}

/// Friction holds on to the start of the step; without it forces of a touch lie on one line.
TEST_P(OnLattice, ForcesOfATouchHaveNoMomentWithoutFriction)
{
    constexpr double kRounding = 1e-12;
    SceneRun run(blocks("[contact]\nfriction = 0\n", "[0.1, 0.54, 0.03]", GetParam()));
    run.toFrame(4);
    const core::Simulation& s = run.simulation;
    solver::Potential& potential = *s.stages().solve.back();
    potential.begin({s.x(), s.v(), 1. / 24, s.elastic(), s.time() + 1. / 24});
    const std::vector<Vec3> x = sum(s.x(), 1. / 96, s.v());
    std::vector<Vec3> gradient(x.size(), Vec3::Zero());
    ASSERT_GT(potential.evaluate(x, gradient), 0);
    double forces = 0;
    Vec3 moment = Vec3::Zero();
    for (std::size_t i = 0; i < x.size(); ++i)
        forces += gradient[i].norm() * x[i].norm(), moment += x[i].cross(gradient[i]);
    EXPECT_LT(moment.norm(), kRounding * forces);
}

/// A slab is pressed flat under a block, and turned over a little: its tets see nothing of the block then. Turned back,
/// they saw it deep within them, behind a wall of energy, in the same solve.
TEST_P(OnLattice, WhatWasFlatBuildsNoWall)
{
    constexpr double kThin = 0.01;  // of how thick the slab was
    SceneRun run(blocks("[contact]\nfriction = 0\n", "[0.1, 0.54, 0.03]", GetParam()));
    run.toFrame(4);
    const core::Simulation& s = run.simulation;
    solver::Potential& potential = *s.stages().solve.back();
    const core::Body& lower = s.bodies().front();
    const double above = 0.3;  // m: where the lower block is pressed onto
    const auto energyAt = [&](double thickness) {
        std::vector<Vec3> x(s.x().begin(), s.x().end()), gradient(x.size(), Vec3::Zero());
        for (std::size_t i = 0; i < lower.mesh->nodeCount(); ++i) {
            double& y = x[lower.firstNode + i].y();
            y = above + thickness * (y - above);
        }
        return std::pair(potential.evaluate(x, gradient), x);
    };
    potential.begin({s.x(), s.v(), 1. / 24, s.elastic(), s.time() + 1. / 24});
    const double wall = energyAt(kThin).first;
    const auto [turned, x] = energyAt(-kThin);
    potential.prune(x);
    EXPECT_EQ(energyAt(-kThin).first, turned);
    EXPECT_GT(wall, 2 * turned);
    EXPECT_LT(energyAt(kThin).first, 1.5 * turned);
}

/// Between two solutions of one solve a ball goes to and fro on another, by a part of a cell: what would go back to
/// where it has come from stays, or each would be solved for in turn.
TEST_P(OnLattice, WhatGoesToAndFroIsHeld)
{
    constexpr double kWay = 0.1;  // cells
    std::string scene =
        "version = 1\nname = \"balls\"\n[time]\nframes = [1, 24]\nfps = 24\n[grid]\nvoxel_size = 0.1\nlattice = \"" +
        std::string(GetParam()) +
        "\"\n[contact]\nfriction = 0\n[material.gel]\nyoungs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = "
        "1000\n";
    for (const char* ball : {"-0.5", "0.5"})
        scene += "[[body]]\nname = \"at" + std::string(ball) +
                 "\"\nmaterial = \"gel\"\nshape = { sphere = { radius = 0.45, center = [0, " + ball +
                 ", 0] } }\nvelocity = [0, " + (ball[0] == '-' ? "1" : "-1") + ", 0]\n";
    SceneRun run(scene);
    while (run.step().measured.at("contact_depth_m") == 0) ASSERT_FALSE(run.atEnd());
    const core::Simulation& s = run.simulation;
    solver::Potential& potential = *s.stages().solve.back();
    potential.begin({s.x(), s.v(), 1. / 96, s.elastic(), s.time() + 1. / 96});
    const std::vector<Vec3> here = sum(s.x(), 1. / 96, s.v());
    std::vector<Vec3> there = here;
    for (std::size_t i = s.bodies().back().firstNode; i < there.size(); ++i) there[i].x() += kWay * s.elastic().h();
    while (potential.refresh(here)) {}
    EXPECT_TRUE(potential.refresh(there));
    EXPECT_FALSE(potential.refresh(here));
}

/// What collisions are given besides: nothing, material that hardly changes its volume, both in short steps.
const std::vector<std::vector<std::string>> kCollisions = {
    {},
    {"material.gel.poisson_ratio=0.49"},
    {"time.fps=240", "time.frames=[1,61]"},
    {"material.gel.poisson_ratio=0.49", "time.fps=240", "time.frames=[1,61]"}};

void expectMomentumStays(const std::string& scene, std::vector<std::string> settings)
{
    constexpr double kDrift = 1e-10, kSolved = 1e-6;
    settings.push_back("solver.newton_tolerance=1e-8");
    SceneRun run(scene, settings);
    const core::Simulation& s = run.simulation;
    const Momentum start = momentumOf(s);
    while (!run.atEnd()) {
        const Momentum before = momentumOf(s);
        const std::vector<Vec3> v(s.v().begin(), s.v().end());
        const double dt = run.step().dt;
        const Momentum now = momentumOf(s);
        ASSERT_LT((now.linear - start.linear).norm(), kDrift * start.size);
        // Without moments backward Euler makes L1 = L0 + dt sum m v1 x v0.
        Vec3 expected = before.angular;
        for (std::size_t i = 0; i < v.size(); ++i) expected += dt * s.elastic().mass()[i] * s.v()[i].cross(v[i]);
        ASSERT_LT((now.angular - expected).norm(), kSolved * start.size);
    }
    EXPECT_GT(run.work.countOf("solve", "couplings"), 0);
}

TEST_P(OnLattice, MomentumOfACollisionStays)
{
    for (const auto& settings : kCollisions)
        expectMomentumStays(blocks("[contact]\nfriction = 0\n", "[0.1, 0.54, 0.03]", GetParam()), settings);
}

/// From no step to the next, with that of touches.
void expectEnergyDoesNotGrow(const std::string& scene, const std::vector<std::string>& settings)
{
    SceneRun run(scene, settings);
    const core::Simulation& s = run.simulation;
    const double start = s.totals().kineticEnergy, grows = 1e-6 * start;
    double elastic = 0, before = start;
    std::vector<Vec3> gradient(s.x().size());
    while (!run.atEnd()) {
        const core::StepRecord& r = run.step();
        elastic = std::max(elastic, r.elasticEnergy);
        const double contact = s.stages().solve.back()->evaluate(s.x(), gradient);
        const double energy = r.kineticEnergy + r.elasticEnergy + contact;
        ASSERT_LT(energy, before + grows);
        ASSERT_LT(r.unnamedShare, 1e-3);
        before = energy;
    }
    EXPECT_GT(elastic, .05 * start);
}

TEST_P(OnLattice, EnergyOfACollisionDoesNotGrow)
{
    for (const auto& settings : kCollisions)
        expectEnergyDoesNotGrow(blocks("[contact]\n", "[0.1, 0.54, 0.03]", GetParam()), settings);
}

TEST_P(OnLattice, WorksOfATouchThatIsOverAddUpToNothing)
{
    constexpr double kSum = 1e-9;  // of the energy at the start
    SceneRun run(blocks("[contact]\nfriction = 0\n", "[0.1, 0.54, 0.03]", GetParam()));
    const double start = run.simulation.totals().kineticEnergy;
    double sum = 0, most = 0;
    while (!run.atEnd()) {
        const auto& flow = run.step().energyFlow;  // names what is not 0
        const double work = flow.contains("contact_work") ? flow.at("contact_work") : 0;
        sum += work, most = std::max(most, std::abs(work));
    }
    EXPECT_GT(most, .001 * start);
    EXPECT_LT(std::abs(sum), kSum * start) << sum << " of " << start;
}

/// A box that is crushed on a floor folds. The second stage of SDIRK2 sets off where the first has been extrapolated
/// to, up to two voxels deep in folds that no motion leads to; pushed out of them it had 1.2 times its energy.
TEST(Contact, OfASecondStageGivesNothing)
{
    constexpr double kGiven = .001;  // of the energy at the start
    SceneRun run(R"(version = 1
name = "crushed"
grid = { voxel_size = 0.05 }
[time]
frames = [1, 4]
substeps = "auto"
[solver]
integrator = "sdirk2"
newton_tolerance = 1e-5
[material.gel]
youngs_modulus = 1e5
poisson_ratio = 0.3
density = 1000
[[body]]
name = "box"
material = "gel"
shape = { box = { size = [0.48, 0.28, 0.28], center = [0, 0.3, 0.03], rotate = [20, 10, 35] } }
velocity = [1, -6, 0]
angular_velocity = [1, 0, 2]
[[collider]]
name = "floor"
shape = { halfspace = { normal = [0, -1, 0] } }
friction = 0.5
[contact]
)");
    const double start = run.simulation.totals().kineticEnergy;
    double sum = 0, most = 0;
    while (!run.atEnd()) {
        const auto& flow = run.step().energyFlow;
        if (flow.contains("contact_work")) sum += flow.at("contact_work"), most = std::max(most, sum);
    }
    EXPECT_GT(run.work.countOf("contact", "active"), 0);
    EXPECT_LT(most, kGiven * start);
}

INSTANTIATE_TEST_SUITE_P(Contact, OnLattice, testing::Values("six", "five", "delaunay"));

}  // namespace
