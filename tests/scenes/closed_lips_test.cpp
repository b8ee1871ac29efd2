// Lips of cracks that touch as they are drawn: closed.
#include <vdbfrac/contact/contact_surface.h>
#include <vdbfrac/lab/scenes/saw.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

using namespace vdbfrac;
using lab::SceneRun;

namespace {

constexpr double kHalfKerf = .03;  // m: 1.2 voxels are sawn away

/// A bar of 20 x 8 x 8 voxels, pushed together by 2 % from the first to the sixth frame, after it has been sawn.
std::string bar(const std::string& more, const char* lattice = "six")
{
    const auto grip = [&](int side) {
        const std::string s = std::to_string(side);
        return "[[grip]]\nbody = \"bar\"\nregion = { halfspace = { normal = [" + s +
               ", 0, 0], offset = 0.45 } }\nmove = { keys = [" +
               "{ time = 0 }, { time = 0.042 }, { time = 0.25, translate = [" + std::to_string(-.01 * side) +
               ", 0, 0] }] }\n";
    };
    return std::string(
               "version = 1\nname = \"bar\"\n[time]\nframes = [1, 13]\nsubsteps = 1\n[grid]\nvoxel_size = "
               "0.05\nlattice = \"") +
           lattice +
           "\"\n[solver]\nintegrator = \"static\"\nnewton_tolerance = 1e-6\n[[body]]\nname = \"bar\"\nmaterial = "
           "\"gel\"\n"
           "shape = { box = { size = [1, 0.4, 0.4] } }\n[material.gel]\nyoungs_modulus = 1e5\npoisson_ratio = "
           "0.3\ndensity = 1000\n" +
           grip(1) + grip(-1) + more;
}

double loadAfter(const std::string& scene, core::Effect* saw)
{
    SceneRun run(scene, {}, saw);
    run.toFrame(7);
    return run.steps.back().gripLoad[0].x();
}

class LipsOnLattice : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(ClosedLips, LipsOnLattice, testing::Values("six", "five"));

/// A closed crack carries pressure as if no material had gone; as simulated it is open until the kerf is used up.
TEST_P(LipsOnLattice, CarryPressureAsIfNothingWasLost)
{
    constexpr double kOff =
        .06;  // .019 on six, .055 on five tets: a tenth of a voxel at the rim, of .4 that it is pressed
    lab::Saw first(0, kHalfKerf), second(0, kHalfKerf);
    const double whole = loadAfter(bar("", GetParam()), nullptr),
                 closed = loadAfter(bar("[contact]\nlips = \"closed\"\n", GetParam()), &first),
                 open = loadAfter(bar("[contact]\n", GetParam()), &second);
    EXPECT_LT(std::abs(open), 1e-6 * std::abs(whole));
    EXPECT_NEAR(closed / whole, 1, kOff);
}

/// A bar that flies and turns on its own; `more` tables.
std::string free(const std::string& more)
{
    return "version = 1\nname = \"bar\"\n[time]\nframes = [1, 25]\n[grid]\nvoxel_size = 0.05\n[[body]]\nname = "
           "\"bar\"\n"
           "material = \"gel\"\nshape = { box = { size = [1, 0.4, 0.4] } }\n" +
           more +
           "[material.gel]\nyoungs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n[contact]\nlips = \"closed\"\n";
}

/// Lips are where they are closed when they are born: nothing pushes them.
TEST(ClosedLips, AreBornAtRest)
{
    constexpr double kStill = 1e-15 * 1e5 * .16;  // J: of E V
    lab::Saw saw(.013, kHalfKerf);
    SceneRun run(free(""), {}, &saw);
    while (!run.atEnd()) EXPECT_LT(run.step().kineticEnergy, kStill);
    EXPECT_EQ(run.simulation.fragments(), 2u);
}

/// Two halves that a bending wave presses and opens: what each does to the other leaves the momentum as it is.
TEST(ClosedLips, KeepMomentum)
{
    constexpr double kRounding = 1e-9;
    lab::Saw saw(.013, kHalfKerf);
    SceneRun run(free("velocity = [0, 1, 0]\nangular_velocity = [0, 0, -3]\n") +
                     "[[body]]\nname = \"wall\"\nmaterial = \"gel\"\nshape = { box = { size = [0.4, 0.4, 0.4], center "
                     "= [0.3, 0.45, 0] } }\n",
                 {}, &saw);
    const auto momentum = [&] {
        Vec3 sum = Vec3::Zero();
        for (std::size_t i = 0; i < run.simulation.x().size(); ++i)
            sum += run.simulation.elastic().mass()[i] * run.simulation.v()[i];
        return sum;
    };
    run.step();
    const Vec3 before = momentum();
    std::int64_t contactsAt = 0;
    while (!run.atEnd()) contactsAt += run.step().work.countOf("contact", "active");
    EXPECT_GT(contactsAt, 0);
    EXPECT_LT((momentum() - before).norm(), kRounding * before.norm() * double(run.steps.size()));
}

/// A cut does not push: what it makes deeper is allowed.
TEST(ClosedLips, ForgiveWhatACutMakesDeeper)
{
    contact::SampleMemory memory;
    memory.see(.1);
    EXPECT_EQ(memory.allowance, .1);
    memory.keep(.3, Vec3::Zero(), 0);  // pressed .2 deeper than it may be
    memory.see(.45);
    EXPECT_DOUBLE_EQ(.45 - memory.allowance, .3 - .1);
    memory.see(.45);  // again
    EXPECT_DOUBLE_EQ(memory.allowance, .25);
    memory.see(.2);  // a cut that takes away
    EXPECT_DOUBLE_EQ(memory.allowance, .25);
}

}  // namespace
