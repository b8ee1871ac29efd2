// What is told before something tears: how much more load it takes, where, and what the surface has in reserve. On a
// bar that is strained alike everywhere, in steps without inertia.
#include <vdbfrac/lab/scenes/rod.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

using namespace vdbfrac;
using lab::SceneRun;

namespace {

constexpr double kE = 1e6, kKappa = 61, kRate = .005;  // Pa, J/m^3, strain a second
const double kCritical = std::sqrt(2 * kKappa / kE);   // strain
const double kTearing = kCritical / kRate;             // s
constexpr double kSolved = 1e-3;                       // of a strain: ends of grips, Newton's tolerance

/// A bar of .25 x .25 m, a metre of it free.
std::string bar(const std::string& more = "")
{
    std::ostringstream s;
    s << "version = 1\nname = \"bar\"\n[time]\nframes = [1, 9]\nfps = 1\nsubsteps = \"auto\"\n[grid]\nvoxel_size = "
         "0.0625\n"
         "[solver]\nintegrator = \"static\"\nnewton_tolerance = 1e-8\n"
         "[[body]]\nname = \"bar\"\nshape = { box = { size = [0.25, 1.5, 0.25] } }\nmaterial = \"m\"\n[material.m]\n"
         "poisson_ratio = 0\ndensity = 1000\nyoungs_modulus = "
      << kE << "\n";
    for (const double side : {1., -1.})
        s << "[[grip]]\nbody = \"bar\"\nregion = { halfspace = { normal = [0, " << side
          << ", 0], offset = 0.5 } }\nmove = { velocity = [0, " << side * kRate / 2 << ", 0] }\n";
    s << "[fracture]\nkappa = " << kKappa << "\n" << more;
    return s.str();
}

TEST(NextTear, IsToldWithTheLoadThatItTakes)
{
    SceneRun run(bar());
    int told = 0;
    while (run.work.countOf("fracture", "moved_voxels") == 0) {
        const core::StepRecord& step = run.step();
        const auto factor = step.measured.find("fracture_load_factor");
        if (factor == step.measured.end()) continue;
        ++told;
        EXPECT_NEAR(factor->second * kRate * step.time, kCritical, kSolved * kCritical) << step.time;
        EXPECT_LE(std::abs(step.measured.at("fracture_next_x_m")), .125 + .0625);
        EXPECT_LE(std::abs(step.measured.at("fracture_next_y_m")), .5);
        EXPECT_LE(std::abs(step.measured.at("fracture_next_z_m")), .125 + .0625);
    }
    EXPECT_GE(told, 3);
}

TEST(NextTear, IsWhereAutomaticStepsEnd)
{
    constexpr double kLate = .01;
    SceneRun run(bar());
    while (run.work.countOf("fracture", "moved_voxels") == 0) run.step();
    EXPECT_GT(run.simulation.time(), kTearing * (1 - kSolved));
    EXPECT_LT(run.simulation.time(), kTearing * (1 + kLate + kSolved));
    EXPECT_LT(run.steps.size(), 8u);  // frames end at 1 s and 2 s
}

TEST(NextTear, IsWhereTheMarginIsLargest)
{
    SceneRun run(bar("grip_margin = 0.125\n"), {"output.vdb=[\"phi\",\"margin\"]"});
    run.toFrame(3);
    const grid::VoxelValues margins = lab::fieldOf(run, "margin");
    ASSERT_GT(margins.coords.size(), 100u);
    const double expected = std::pow(kRate * run.simulation.time() / kCritical, 2);
    const auto [least, most] = std::minmax_element(margins.scalars.begin(), margins.scalars.end());
    EXPECT_NEAR(*least, expected, 3 * kSolved * expected);
    EXPECT_NEAR(*most, expected, 3 * kSolved * expected);
    const double factor = run.steps.back().measured.at("fracture_load_factor");
    EXPECT_NEAR(*most * factor * factor, 1, 1e-6);
    EXPECT_TRUE(lab::fieldOf(SceneRun(bar()), "margin").coords.empty());
}

/// Between stiff faces, nearly incompressible material is pulled from all sides in the middle: by
/// (1 - nu) / ((1 + nu) (1 - 2 nu)) = 3.8 times what pulls its rim.
TEST(Nucleation, IsInTheMiddleOfADiscWhereItMayBe)
{
    struct First {
        grid::VoxelValues arrival;
        std::vector<core::StepRecord> steps;
    };
    const auto first = [](const std::string& more) {
        std::ostringstream s;
        s << "version = 1\nname = \"disc\"\n[time]\nframes = [1, 31]\nfps = 1\nsubsteps = 1\n[grid]\nvoxel_size = 0.1\n"
             "[solver]\nintegrator = \"static\"\n[[body]]\nname = \"disc\"\nmaterial = \"m\"\n"
             "shape = { box = { size = [2.4, 1.2, 2.4] } }\n[material.m]\nyoungs_modulus = 1e6\npoisson_ratio = 0.45\n"
             "density = 1000\n";
        for (const double side : {1., -1.})
            s << "[[grip]]\nbody = \"disc\"\nregion = { halfspace = { normal = [0, " << side
              << ", 0], offset = 0.4 } }\nmove = { velocity = [0, " << side * 4e-4 << ", 0] }\n";
        s << "[fracture]\nkappa = 200\ngrip_margin = 0.1\n" << more;
        SceneRun run(s.str());
        while (run.work.countOf("fracture", "moved_voxels") == 0 && run.steps.size() < 30) run.step();
        return First{lab::fieldOf(run, "arrival"), run.steps};
    };
    constexpr double kMiddle = .4;  // m
    const First inside = first("nucleation = \"inside\"\n"), surface = first("");
    ASSERT_GT(inside.arrival.coords.size(), 0u);
    for (const Coord& c : inside.arrival.coords) EXPECT_LE((.1 * c.toVec()).lpNorm<Eigen::Infinity>(), kMiddle);
    EXPECT_TRUE(surface.arrival.coords.empty());
    EXPECT_LT(inside.arrival.coords.size(), 40u);  // a hole 2.5 voxels wide

    // Loads grow with time: the same onset is foretold from the first step that tells it to the one that tears.
    std::vector<double> onset;
    for (const core::StepRecord& r : inside.steps) {
        const auto factor = r.measured.find("fracture_load_factor");
        if (factor == r.measured.end()) continue;
        onset.push_back(factor->second * r.time);
        for (const char* axis : {"x", "y", "z"})
            EXPECT_LE(std::abs(r.measured.at(std::string("fracture_next_") + axis + "_m")), kMiddle);
    }
    ASSERT_GE(onset.size(), 3u);
    EXPECT_LT(inside.steps.back().measured.at("fracture_load_factor"), 1);
    for (double time : onset) EXPECT_NEAR(time / onset.back(), 1, .01);
}

}  // namespace
