// When a step counts as solved: beyond the norm of all forces.
#include <vdbfrac/base/error.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <vector>

using namespace vdbfrac;
using lab::SceneRun;

namespace {

/// A soft crumb falls on the floor beside a block 1e7 times as hard, which is squeezed and at rest by then.
std::string crumb()
{
    std::string scene =
        "version = 1\nname = \"crumb\"\n[time]\nframes = [1, 13]\nfps = 24\n[grid]\nvoxel_size = 0.01\n"
        "[[body]]\nname = \"block\"\nmaterial = \"hard\"\n"
        "shape = { box = { size = [0.1, 0.1, 0.1], center = [0, 0.1, 0] } }\n"
        "[[body]]\nname = \"crumb\"\nmaterial = \"soft\"\n"
        "shape = { box = { size = [0.03, 0.03, 0.03], center = [0.2, 0.12, 0] } }\n"
        "[material.hard]\nyoungs_modulus = 1e11\npoisson_ratio = 0.3\ndensity = 1000\n"
        "[material.soft]\nyoungs_modulus = 1e4\npoisson_ratio = 0.3\ndensity = 1000\n"
        "[[collider]]\nshape = { halfspace = { normal = [0, -1, 0] } }\n[gravity]\n"
        "[damping]\nmass = 0.5\nstiffness = 0.1\n";
    for (const char* grip : {"[0, 1, 0], offset = 0.14 } }\nmove = { keys = [{ time = 0 }, { time = 0.1, translate = "
                             "[0, 0.05, 0] }] }\n",
                             "[0, -1, 0], offset = -0.06 } }\nmove = { velocity = [0, 0, 0] }\n"})
        scene += std::string("[[grip]]\nbody = \"block\"\nregion = { halfspace = { normal = ") + grip;
    return scene;
}

/// Its forces are a millionth of the block's: less than what the norm of all has to be solved to.
TEST(SolvedStep, StopsALightPieceBesideAHardOne)
{
    constexpr double kDx = .01;  // m
    SceneRun run(crumb());
    double deepest = 0;
    while (!run.atEnd()) deepest = std::max(deepest, run.step().measured.at("collider_depth_m"));
    EXPECT_GT(deepest, .01 * kDx);  // it has come down
    EXPECT_LT(deepest, .08 * kDx);
}

TEST(SolvedStep, EndsAfterItBegins)
{
    SceneRun run(crumb());
    run.simulation.step(.01);
    const double time = run.simulation.time();
    for (const double until : {time, time / 2, 0., -1., std::nan(""), std::numeric_limits<double>::infinity()})
        EXPECT_THROW(run.simulation.step(until), InputError) << until;
    EXPECT_EQ(run.simulation.time(), time);
    EXPECT_THROW(run.simulation.gripNodes(2), InputError);
}

/// A potential without forces, which lets nodes move so far in a step and no farther.
class Leash : public core::Effect, public solver::Potential {
public:
    explicit Leash(double length) : length_(length) {}

    std::string name() const override { return "leash"; }
    void join(core::Stages& stages) override { stages.solve.push_back(this); }
    void begin(const solver::StepStart& start) override { start_.assign(start.x.begin(), start.x.end()); }
    double evaluate(std::span<const Vec3>, std::span<Vec3>) const override { return 0; }
    solver::EnergyFlow flow(const solver::Leg&) const override { return {}; }
    bool isAdmissible(const solver::WholeStep& way) const override
    {
        for (std::size_t i = 0; i < way.to.size(); ++i)
            if (way.from[i] != start_[i] || (way.to[i] - start_[i]).norm() > length_) return false;
        return true;
    }

private:
    double length_;  // m
    std::vector<Vec3> start_;
};

/// Of a body that flies at 1 m/s.
core::StepRecord firstStep(double leash)
{
    Leash effect(leash);
    SceneRun run(
        "version = 1\nname = \"flying\"\n[time]\nframes = [1, 2]\nfps = 16\nsubsteps = 1\n[grid]\n"
        "voxel_size = 0.1\n[[body]]\nname = \"box\"\nmaterial = \"gel\"\nvelocity = [1, 0, 0]\n"
        "shape = { box = { size = [0.4, 0.4, 0.4] } }\n[material.gel]\nyoungs_modulus = 1e5\n"
        "poisson_ratio = 0.3\ndensity = 1000\n",
        {}, &effect);
    return run.step();
}

TEST(SolvedStep, IsHalvedUntilWhatItEndsInHolds)
{
    constexpr double kWhole = 1. / 16;  // s
    const core::StepRecord free = firstStep(.07), leashed = firstStep(.02), hopeless = firstStep(0);
    EXPECT_EQ(free.cutbacks, 0);
    EXPECT_EQ(free.dt, kWhole);
    EXPECT_EQ(leashed.cutbacks, 2);
    EXPECT_EQ(leashed.outcome, core::Outcome::cutback);
    EXPECT_EQ(leashed.dt, kWhole / 4);
    EXPECT_EQ(hopeless.cutbacks, 8);  // then it is kept
    EXPECT_EQ(hopeless.outcome, core::Outcome::capped);
    EXPECT_FALSE(hopeless.measured.contains("unsolved_x_m"));  // its forces were in balance
}

/// Of two bodies only the one that spins is hard to solve; a point of it is named, where it is at rest.
TEST(SolvedStep, TellsWhereItWasNotSolved)
{
    SceneRun run(
        "version = 1\nname = \"two\"\n[time]\nframes = [1, 2]\nfps = 24\nsubsteps = 1\n[solver]\n"
        "newton_iterations = 1\nnewton_tolerance = 1e-9\n[grid]\nvoxel_size = 0.1\n"
        "[[body]]\nname = \"still\"\nmaterial = \"gel\"\nshape = { box = { size = [0.4, 0.4, 0.4] } }\n"
        "[[body]]\nname = \"spins\"\nmaterial = \"gel\"\nangular_velocity = [0, 0, 9]\n"
        "shape = { box = { size = [0.4, 0.4, 0.4], center = [2, 1, 0] } }\n"
        "[material.gel]\nyoungs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n");
    const core::StepRecord step = run.step();
    ASSERT_EQ(step.outcome, core::Outcome::capped);
    const Vec3 at(step.measured.at("unsolved_x_m"), step.measured.at("unsolved_y_m"), step.measured.at("unsolved_z_m"));
    const Vec3 away = (at - Vec3(2, 1, 0)).cwiseAbs();
    EXPECT_LE(away.maxCoeff(), .3) << at.transpose();  // its nodes reach to the next voxel
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(at[axis] / .1, std::round(at[axis] / .1), 1e-9) << at.transpose();
}

}  // namespace
