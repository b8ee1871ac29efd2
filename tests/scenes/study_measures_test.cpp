// What is measured of a run, on scenes whose answers are known.
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/lab/study/one_run.h>
#include <vdbfrac/scene/reader.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace vdbfrac::lab::study {
namespace {

constexpr double kSolved = 1e-6;  // what the Newton tolerance of these scenes leaves open
constexpr double kCell = .25;     // m

/// A block of one metre, 1000 kg/m^3, in cells of kCell; half a second in ten steps.
std::string blockScene(const std::string& body, const std::string& more)
{
    return "time = { frames = [1, 6], fps = 10, substeps = 2 }\ngrid.voxel_size = 0.25\n"
           "solver = { newton_tolerance = 1e-9, linear_tolerance = 1e-6 }\n"
           "[[body]]\nname = \"block\"\nshape = { box = { size = [1, 1, 1] } }\nmaterial = \"m\"\n" +
           body + "\n[material.m]\nyoungs_modulus = 1e6\npoisson_ratio = 0.3\ndensity = 1000\n" + more;
}

/// The values of measures, in the form "{ quantity = ..., ... }".
std::vector<Value> measured(const std::string& text, const std::string& measures)
{
    const scene::Scene scene = scene::parseScene(text, "test.toml", vocabulary(), {"study.measure=[" + measures + "]"});
    return simulate(scene, specOf(scene)->measures, std::numeric_limits<std::uint64_t>::max()).values;
}

double numberOf(const Value& v)
{
    EXPECT_TRUE(v.has()) << v.missing;
    return v.numbers.size() == 1 ? v.numbers[0] : NAN;
}

TEST(StudyMeasures, AFreeSpinKeepsItsMomentum)
{
    const auto v = measured(
        blockScene("velocity = [1, 0, 0]\nangular_velocity = [0, 0, 0.5]", ""),
        "{quantity='momentum'},{quantity='angular_momentum'},{quantity='angular_velocity'},{quantity='volume'},"
        "{quantity='fragments'},{quantity='fragment_masses'},{quantity='kinetic_energy'},{quantity='onset'}");
    constexpr double kStretch = 0.05;  // backward Euler lets a spin turn into less of one and into heat
    const double mass = 1000 * numberOf(v[3]);
    EXPECT_LT(numberOf(v[0]), kSolved);
    EXPECT_LT(numberOf(v[1]), kStretch);
    EXPECT_NEAR(numberOf(v[2]), .5, kStretch * .5);
    EXPECT_NEAR(mass, 1000, 1000 * kSolved);
    EXPECT_EQ(numberOf(v[4]), 1);
    EXPECT_NEAR(numberOf(v[5]), mass, mass * kSolved);
    // 1/2 m v^2, and the spin: I w^2 / 2 of a cube whose cells have their mass at their corners.
    const double inertia = 1. / 6 + kCell * kCell / 3;
    EXPECT_GT(numberOf(v[6]), .5 * mass);
    EXPECT_LT(numberOf(v[6]), (.5 + .25 / 2 * inertia) * mass);
    EXPECT_EQ(v[7].missing, "nothing tore");
}

TEST(StudyMeasures, WhatAFreeFallDissipatesIsThatOfBackwardEuler)
{
    const auto v = measured(
        blockScene("", "[gravity]\nacceleration = [0, -2, 0]\n"),
        "{quantity='displacement',point=[0.3,0.1,0.2],axis='y'},{quantity='displacement',name='all',point=[0,0,0]},"
        "{quantity='kinetic_energy'},{quantity='dissipated'},{quantity='energy_balance'},{quantity='energy_norm'},{"
        "quantity='volume'}");
    const double t = .5, dt = .05, fall = .5 * 2 * t * (t + dt),
                 kinetic = .5 * 1000 * numberOf(v[6]) * (2 * t) * (2 * t);
    EXPECT_NEAR(numberOf(v[0]), -fall, kSolved);
    EXPECT_NEAR(numberOf(v[1]), fall, kSolved);
    EXPECT_NEAR(numberOf(v[2]), kinetic, kinetic * kSolved);
    EXPECT_NEAR(numberOf(v[3]), kinetic * dt / t, kinetic * kSolved);
    EXPECT_NEAR(numberOf(v[4]), -dt / t, kSolved);
    EXPECT_NEAR(numberOf(v[5]), 0, kSolved * kinetic);
}

TEST(StudyMeasures, AForceDoesWorkOverTheWayOfWhatItPulls)
{
    const std::string grip =
        "[[grip]]\nname = \"all\"\nbody = \"block\"\nregion.sphere.radius = 9\nmove.force = [300, 0, -400]\n";
    const auto v = measured(blockScene("", grip),
                            "{quantity='load_work'},{quantity='displacement',point=[0,0,0]},{quantity='load_peak'},"
                            "{quantity='load_end',axis='z'},{quantity='peak_energy'}");
    EXPECT_NEAR(numberOf(v[0]), 500 * numberOf(v[1]), 500 * kSolved);
    EXPECT_NEAR(numberOf(v[2]), 500, 500 * kSolved);
    EXPECT_NEAR(numberOf(v[3]), -400, 500 * kSolved);
    EXPECT_LT(numberOf(v[4]), kSolved);
}

TEST(StudyMeasures, AFloorCarriesWhatItStops)
{
    const std::string floor =
        "[gravity]\nacceleration = [0, -2, 0]\n[damping]\nstiffness = 0.05\n[[collider]]\nname = \"floor\"\n"
        "shape = { halfspace = { normal = [0, -1, 0], offset = 0.5 } }\n";
    const auto v = measured(blockScene("", floor),
                            "{quantity='collider_load_end',axis='y'},{quantity='collider_load_peak',collider='floor'},"
                            "{quantity='volume'}");
    const double weight = 1000 * numberOf(v[2]) * 2;
    EXPECT_NEAR(numberOf(v[0]), weight, .02 * weight);
    EXPECT_GE(numberOf(v[1]), numberOf(v[0]));
}

TEST(StudyMeasures, StretchingStoresTheWorkThatIsNotLost)
{
    std::string grips;
    for (const char* side : {"", "-"})  // after a step at rest, so that no energy is there before
        grips += std::string("[[grip]]\nname = \"g") + side +
                 "\"\nbody = \"block\"\nregion.halfspace = { normal = [0, " + side +
                 "1, 0], offset = 0.5 }\nmove.keys = [{ time = 0.05 }, { time = 0.5, translate = [0, " + side +
                 "0.01, 0] }]\n";
    const auto v = measured(blockScene("", grips),
                            "{quantity='load_work',grip='g',name='a'},{quantity='load_work',grip='g-',name='b'},"
                            "{quantity='energy_norm'},{quantity='kinetic_energy'},{quantity='dissipated'},"
                            "{quantity='displacement',point=[0,0.5,0],axis='y'},{quantity='period',point=[0,0.5,0],"
                            "axis='y'},{quantity='volume'}");
    const double work = numberOf(v[0]) + numberOf(v[1]), stored = .5 * numberOf(v[2]) * numberOf(v[2]);
    const double narrow = .5 * 1e6 * .02 * .02 * numberOf(v[7]);  // of a bar that may narrow: E e^2 / 2
    EXPECT_GT(stored, .99 * narrow);                              // held ends make it stiffer
    EXPECT_LT(stored, 1.3 * narrow);
    EXPECT_NEAR(work, stored + numberOf(v[3]) + numberOf(v[4]), kSolved * work);
    EXPECT_LT(std::abs(numberOf(v[4])), .05 * work);  // of a slow pull little is lost
    EXPECT_NEAR(numberOf(v[5]), .01, kSolved);
    EXPECT_EQ(v[6].missing, "fewer than two swings");
}

/// The period of a bar's longest wave by steps of 1/10, 1/20 and 1/40 of it. It is released under its weight, so it
/// swings in shorter waves too.
TEST(StudyMeasures, TheLongestWaveOfABarHasAPeriodOfSecondOrderInTheStep)
{
    const std::string bar =
        "solver = { integrator = \"midpoint\", newton_tolerance = 1e-9 }\n"
        "grid.voxel_size = 0.1\n[[body]]\nname = \"bar\"\nshape = { box = { size = [1.1, 0.2, 0.2], center = [0.45, 0, "
        "0] } }\n"
        "material = \"m\"\n[material.m]\nyoungs_modulus = 1e5\npoisson_ratio = 0\ndensity = 1000\n"
        "[gravity]\nacceleration = [0.1, 0, 0]\n"
        "[[grip]]\nbody = \"bar\"\nregion.halfspace = { normal = [-1, 0, 0], offset = 0 }\nmove.velocity = [0, 0, 0]\n";
    std::vector<double> wave;
    for (const int substeps : {1, 2, 4}) {
        const std::string time = "time = { frames = [1, 26], fps = 25, substeps = " + std::to_string(substeps) + " }\n";
        wave.push_back(numberOf(measured(time + bar, "{quantity='period',point=[0,0,0],axis='x',wavelength=4}")[0]));
    }
    constexpr double kOrder = .15;  // as in the numerics tests of integrators
    EXPECT_NEAR(std::log2((wave[0] - wave[1]) / (wave[1] - wave[2])), 2, kOrder);
    constexpr double kEdges = .05;  // of a box two voxels thick, which lacks them at its free end
    EXPECT_NEAR(wave[2], .4, kEdges * .4);
}

/// In free flight v falls by 1 + a dt a step: damping takes a v1^2 m dt of the energy, the integrator m (v0 - v1)^2
/// / 2.
TEST(StudyMeasures, WhatDampingTakesIsDissipatedAndNotMissing)
{
    constexpr double a = 1, dt = 0.05;  // 1/s, s
    const auto v = measured(blockScene("velocity = [1, 0, 0]", "[damping]\nmass = 1\n"),
                            "{quantity='energy_balance'},{quantity='dissipated'},{quantity='kinetic_energy'}");
    const double end = std::pow(1 + a * dt, -10), first = numberOf(v[2]) / (end * end);  // of the velocity; J
    double missing = 0;
    for (int step = 0; step < 10; ++step) missing += std::pow(std::pow(1 + a * dt, -step) * a * dt / (1 + a * dt), 2);
    EXPECT_NEAR(numberOf(v[0]), -missing, kSolved);
    EXPECT_NEAR(numberOf(v[1]), first - numberOf(v[2]), kSolved * first);
}

/// A grip that sets off at .1 s to turn does work by its torque: what it puts in is what the block holds in the end,
/// and what was lost.
TEST(StudyMeasures, AGripThatTurnsDoesWork)
{
    const std::string grip =
        "[[grip]]\nbody = \"block\"\nregion.halfspace = { normal = \"y\", offset = 0.5 }\n"
        "move = { keys = [{ time = 0 }, { time = 0.1 }, { time = 1, rotate = [0, 5, 0] }] }\n";
    const auto v =
        measured(blockScene("", grip),
                 "{quantity='load_work'},{quantity='dissipated'},{quantity='energy_norm'},{quantity='kinetic_energy'}");
    const double kept = 0.5 * std::pow(numberOf(v[2]), 2) + numberOf(v[3]);
    EXPECT_GT(kept, 0);
    EXPECT_NEAR(numberOf(v[0]), numberOf(v[1]) + kept, kSolved * numberOf(v[0]));
}

TEST(StudyMeasures, AfterASplitThereAreMassesAndNoPositions)
{
    std::string s =
        "time = { frames = [1, 8], fps = 4 }\ngrid.voxel_size = 0.1\n[[body]]\nname = \"bar\"\n"
        "shape = { box = { size = [0.4, 1, 0.4] } }\ncut = [{ cylinder = { axis = \"z\", radius = 0.1, center = [0.2, "
        "0, 0] } }]\n"
        "material = \"m\"\n[material.m]\nyoungs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = "
        "1000\n[fracture]\ntoughness = 60\n";
    for (const char* side : {"", "-"})
        s += std::string("[[grip]]\nbody = \"bar\"\nregion = { box = { size = [1, 0.1, 1], center = [0, ") + side +
             "0.4, 0] } }\nmove = { velocity = [0, " + side + "0.1, 0] }\n";
    const auto v =
        measured(s,
                 "{quantity='onset'},{quantity='fragments'},{quantity='fragment_masses'},{quantity='volume'},"
                 "{quantity='displacement',point=[0,0.4,0]},{quantity='damping',point=[0,0.4,0],axis='y'}");
    EXPECT_GT(numberOf(v[0]), 0);
    EXPECT_LE(numberOf(v[0]), 1.75);
    ASSERT_GE(numberOf(v[1]), 2);
    ASSERT_EQ(double(v[2].numbers.size()), numberOf(v[1]));
    double sum = 0;
    for (const double m : v[2].numbers) sum += m;
    EXPECT_NEAR(sum, 1000 * numberOf(v[3]), 1000 * kSolved);
    EXPECT_EQ(v[4].missing, "after a split");
    EXPECT_EQ(v[5].missing, "after a split");
}

}  // namespace
}  // namespace vdbfrac::lab::study
