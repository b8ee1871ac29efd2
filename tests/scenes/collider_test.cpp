// Bodies against colliders: forces against differences of the energy, and motion against closed forms.
#include "potential_differences.h"
#include "sled.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/lab/scenes/scene_run.h>
#include <vdbfrac/solver/linear_solver.h>

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>
#include <string>

#include <unistd.h>

using namespace vdbfrac;
using namespace vdbfrac::test;
using lab::SceneRun;

namespace {

constexpr double kBeta = 10, kGap = 0.25;  // as [[collider]] has them: stiffness, and voxels of gap

TEST(Collider, ForcesAndTheirDerivativeAreThoseOfTheEnergy)
{
    constexpr double kStep = 1e-6, kError = 1e-5;  // of central differences, and of weights kept as floats
    const std::string obstacles =
        "[[collider]]\nshape = { sphere = { radius = 0.3, center = [0.2, -0.2, 0.1] } }\n"
        "move = { keys = [{ time = 0 }, { time = 1, translate = [0.3, 0.2, 0], rotate = [10, 20, 30] }] }\n"
        "[[collider]]\nshape = { capsule = { axis = [1, 1, 0], radius = 0.1, height = 0.4, center = [-0.1, 0.02, 0] } "
        "}\n";
    SceneRun run(Sled{.start = 0.5, .more = obstacles}.text());
    for (int i = 0; i < 3; ++i) run.step();
    const core::Simulation& s = run.simulation;
    solver::Potential& potential = *s.stages().solve.back();
    std::mt19937 random(3);
    std::uniform_real_distribution<double> any(-1, 1);
    const auto randoms = [&](double size) {
        std::vector<Vec3> u(s.x().size());
        for (Vec3& v : u) v = size * Vec3(any(random), any(random), any(random));
        return u;
    };
    potential.begin({s.x(), s.v(), .05, s.elastic(), s.time() + .05});
    const std::vector<Vec3> u = randoms(1), x = sum(s.x(), .004, randoms(1));
    const PotentialAlong along = potentialAlong(potential, x, u, kStep);
    ASSERT_GT(along.energy, 0);
    EXPECT_NEAR(along.slopeOfEnergy, along.slope, kError * std::abs(along.slope));
    for (const solver::Coupling& c : along.couplings) EXPECT_TRUE(c.isExternal());
    // The curvature of round colliders is left out: it is negative, by depth over radius.
    constexpr double kCurvature = 0.05;
    EXPECT_GT(along.tangent, along.tangentOfGradient * (1 - kError));
    EXPECT_LT(along.tangent, along.tangentOfGradient * (1 + kCurvature));
}

/// k s^2 / (2 s1) = p: how far a block sinks that touched and had no weight.
TEST(Collider, CarriesAWeightAtTheDepthOfItsStiffness)
{
    constexpr double kSmooth = 0.02, kWithin = 0.01, kDx = 0.025;  // of a cell; relative; m
    constexpr double kStiff = 1e7;                                 // Pa: so stiff that it keeps its shape
    for (const char* lattice : {"six", "five"}) {
        SceneRun run(
            Sled{.friction = 0, .youngsModulus = kStiff, .frames = 24, .voxel = kDx, .lattice = lattice}.text());
        const std::vector<Vec3> start(run.simulation.x().begin(), run.simulation.x().end());
        run.toEnd();
        std::vector<double> sunk;
        for (std::size_t i = 0; i < start.size(); ++i)
            if (std::abs(start[i].y()) < .1 * kDx) sunk.push_back(start[i].y() - run.simulation.x()[i].y());
        std::nth_element(sunk.begin(), sunk.begin() + std::ptrdiff_t(sunk.size() / 2), sunk.end());
        const double p = kDensity * kG * Sled::kHeight, k = kBeta * kStiff / kDx;
        EXPECT_NEAR(sunk[sunk.size() / 2] / std::sqrt(2 * kSmooth * kDx * p / k), 1, kWithin) << lattice;
    }
}

/// What a collider carries is a weight, and on a slope friction holds the rest; each of two floors its own.
TEST(Collider, ToldLoadsAreTheWeight)
{
    constexpr double kWithin = 1e-3, angle = .2;
    Sled sled{.frames = 72, .more = "[damping]\nstiffness = 0.02\n"};
    sled.gravity = onSlope(angle);
    sled.more += "[[collider]]\nname = \"far\"\nshape = { box = { size = [1, 1, 1], center = [9, 9, 9] } }\n";
    SceneRun run(sled.text());
    run.toEnd();
    const auto load = [&](const std::string& collider) {
        const auto along = [&](const char* axis) {
            return run.steps.back().measured.at("collider_load_" + collider + "_" + axis + "_N");
        };
        return Vec3(along("x"), along("y"), along("z"));
    };
    double mass = 0;
    for (const double m : run.simulation.elastic().mass()) mass += m;
    EXPECT_LT((load("floor") + mass * onSlope(angle)).norm(), kWithin * mass * kG) << load("floor").transpose();
    EXPECT_EQ(load("far"), Vec3::Zero());
}

/// Colliders that are far away change no bit, and are compared with no sample.
TEST(Collider, CostsWhatIsNear)
{
    Sled sled{.frames = 12};
    const auto run = [&] {
        SceneRun run(sled.text());
        run.toEnd();
        return std::pair(run.simulation.stateHash(), run.work.countOf("collider", "pairs"));
    };
    const auto alone = run();
    EXPECT_GT(alone.second, 0);
    for (int i = 0; i < 30; ++i)
        sled.more += "[[collider]]\nshape = { sphere = { radius = 0.1, center = [" + number(1 + .3 * i) +
                     ", 0.2, 0] } }\n"
                     "move = { velocity = [0, 0, 0.1] }\n";
    EXPECT_EQ(run(), alone);
}

/// A block falls onto a box, and onto the same box as a mesh.
TEST(Collider, AMeshCarriesAsTheSolidThatItIsOf)
{
    const std::filesystem::path folder =
        std::filesystem::temp_directory_path() / ("vdbfrac-colliders-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder);
    std::string mesh;
    for (int i = 0; i < 8; ++i)
        mesh +=
            "v " + number((i & 1) - .5) + " " + number(.3 * (i >> 1 & 1) - .35) + " " + number((i >> 2) - .5) + "\n";
    mesh += "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    writeText(folder / "table.obj", mesh);
    const auto rest = [&](const std::string& shape) {
        SceneRun run(Sled{.start = 0, .lift = .02, .frames = 30}.text(), {"collider.0.shape=" + shape});
        run.toEnd();
        EXPECT_GT(run.work.countOf("solve", "couplings"), 0) << shape;
        return mean(run.simulation, run.simulation.x());
    };
    const Vec3 solid = rest("{ box = { size = [1, 0.3, 1], center = [0, -0.2, 0] } }");
    const Vec3 ofMesh = rest("{ mesh = \"" + (folder / "table.obj").string() + "\" }");
    EXPECT_LT((ofMesh - solid).norm(), .02 * Sled::kDx) << ofMesh.transpose() << "; " << solid.transpose();
    std::filesystem::remove_all(folder);
}

/// What was tangled when a scene began is left as deep as it was, not thrown out.
TEST(Collider, DoesNotThrowOutWhatBeganInsideIt)
{
    SceneRun run(Sled{.gravity = {0, 0, 0}, .lift = -.08}.text());
    for (int i = 0; i < 10; ++i) EXPECT_LT(run.step().kineticEnergy, 1e-30);
    SceneRun pressed(Sled{.lift = -.08}.text());
    pressed.toEnd();
    const double sunk = Sled::kHeight / 2 - .08 - mean(pressed.simulation, pressed.simulation.x()).y();
    EXPECT_GT(sunk, 0);
    EXPECT_LT(sunk, .1 * Sled::kDx);
}

/// It comes out as fast as it is told to, and no faster.
TEST(Collider, PushesOutWhatBeganInsideIt)
{
    constexpr double kLift = -.08, kSpeed = .1, kWithin = .1, kTime = .5;  // m, m/s, 1, s
    SceneRun run(Sled{.gravity = {0, 0, 0}, .lift = kLift, .more = "untangle_speed = 0.1\n"}.text());
    const double start = mean(run.simulation, run.simulation.x()).y();
    run.toFrame(1 + int(kTime * 24));
    EXPECT_NEAR((mean(run.simulation, run.simulation.x()).y() - start) / (kSpeed * kTime), 1, kWithin);
    EXPECT_LT(run.steps.back().unnamedShare, 1e-3);
    run.toEnd();
    EXPECT_GT(mean(run.simulation, run.simulation.x()).y(), Sled::kHeight / 2);
    EXPECT_LT(velocity(run.simulation).y(), kSpeed * (1 + kWithin));
}

/// What friction does is the same at any step, material and lattice.
struct Sliding {
    int fps;
    double poissonRatio;
    const char* lattice;

    /// For some seconds. Damped, as short steps let it ring on.
    Sled sled(double seconds) const
    {
        Sled s;
        s.more = "[damping]\nstiffness = 0.01\n";
        s.fps = fps, s.frames = at(seconds) - 1, s.lattice = lattice, s.poissonRatio = poissonRatio;
        return s;
    }
    int at(double seconds) const { return 1 + int(std::lround(fps * seconds)); }
};
class Friction : public testing::TestWithParam<Sliding> {};

INSTANTIATE_TEST_SUITE_P(Settings, Friction,
                         testing::Values(Sliding{24, 0, "six"}, Sliding{240, .3, "six"}, Sliding{24, .49, "six"},
                                         Sliding{24, .3, "five"}, Sliding{240, .49, "five"},
                                         Sliding{24, .3, "delaunay"}),
                         [](const auto& info) {
                             return std::string(info.param.lattice) + std::to_string(info.param.fps) + "Nu" +
                                    std::to_string(int(100 * info.param.poissonRatio));
                         });

TEST_P(Friction, HoldsOnASlopeThatIsNotTooSteep)
{
    constexpr double kCreep = 1e-9;  // m in a second
    Sled sled = GetParam().sled(3);
    sled.gravity = onSlope(.9 * std::atan(.3));
    SceneRun run(sled.text());
    run.toFrame(GetParam().at(2));
    const Vec3 settled = mean(run.simulation, run.simulation.x());
    run.toEnd();
    EXPECT_LT((mean(run.simulation, run.simulation.x()) - settled).norm(), kCreep);
}

TEST_P(Friction, LetsSlideOnASteeperOne)
{
    constexpr double kWithin = 0.01, angle = .5;
    Sled sled = GetParam().sled(1.5);
    sled.gravity = onSlope(angle);
    SceneRun run(sled.text());
    run.toFrame(GetParam().at(.5));
    const double early = velocity(run.simulation).x();
    run.toEnd();
    const double acceleration = (velocity(run.simulation).x() - early) / 1.;
    EXPECT_NEAR(acceleration / (kG * (std::sin(angle) - .3 * std::cos(angle))), 1, kWithin);
}

/// Solids that overlap share what pushes, not what holds.
TEST(SlidingFriction, IsThatOfOneFloorWhereSeveralOverlap)
{
    constexpr double kWithin = 0.01, angle = .5;
    Sled sled{.frames = 36, .more = "[damping]\nstiffness = 0.01\n"};
    sled.gravity = onSlope(angle);
    for (int floors : {2, 3}) {
        sled.more += "[[collider]]\nfriction = 0.3\nshape = { box = { size = [40, 1, 4], center = [0, -0.5, 0] } }\n";
        SceneRun run(sled.text());
        run.toFrame(13);
        const double early = velocity(run.simulation).x();
        run.toEnd();
        const double acceleration = (velocity(run.simulation).x() - early) / 1.;
        EXPECT_NEAR(acceleration / (kG * (std::sin(angle) - .3 * std::cos(angle))), 1, kWithin) << floors;
    }
}

/// What is pulled slowly and sticks slips by its load over the stiffness of its touches, whatever the stages of a step.
TEST(SlidingFriction, SticksAlikeUnderEachScheme)
{
    constexpr double kWithin = 5e-3;  // the rims of its base, where little presses, slip a little
    const Sled sled{.frames = 48,
                    .more =
                        "[damping]\nstiffness = 0.01\n[[grip]]\nbody = \"block\"\nregion = { halfspace = { normal = "
                        "\"y\", offset = 0.15 } }\nmove = { force = [20, 0, 0], ramp = 1.5 }\n"};
    const std::string alone = sled.text().substr(0, sled.text().find("[[collider]]")) + sled.more;
    const std::string onABlock =
        alone +
        "[contact]\nfriction = 0.3\n[[body]]\nname = \"floor\"\nmaterial = \"gel\"\nshape = { box = { size = [0.8, "
        "0.2, 0.8], center = [0, -0.1, 0] } }\n[[grip]]\nbody = \"floor\"\nregion = { halfspace = { normal = "
        "[0, -1, 0], offset = -0.1 } }\nmove = { velocity = [0, 0, 0] }\n";
    for (const std::string& scene : {sled.text(), onABlock}) {
        const auto slipped = [&](const std::string& scheme) {
            SceneRun run(scene, {"solver.integrator=\"" + scheme + "\""});
            run.toEnd();
            const core::Simulation& s = run.simulation;
            double sum = 0, mass = 0;
            for (std::size_t i = 0; i < s.bodies()[0].mesh->nodeCount(); ++i)
                sum += s.elastic().mass()[i] * s.x()[i].x(), mass += s.elastic().mass()[i];
            return sum / mass;
        };
        const double expected = slipped("backward_euler");
        EXPECT_GT(expected, 1e-5);
        EXPECT_NEAR(slipped("sdirk2") / expected, 1, kWithin) << scene;
    }
}

/// v0^2 / (2 mu g), less v0 dt / 2 by backward Euler.
TEST_P(Friction, StopsWhatSlides)
{
    constexpr double kStart = 2, kWithin = 0.01;
    Sled sled = GetParam().sled(1);
    sled.start = kStart;
    SceneRun run(sled.text());
    run.toEnd();
    const double way = kStart * kStart / (2 * .3 * kG) - kStart / GetParam().fps / 2;
    EXPECT_NEAR(mean(run.simulation, run.simulation.x()).x() / way, 1, kWithin);
    EXPECT_LT(velocity(run.simulation).norm(), .01 * kStart);
}

/// Explicit schemes ask for the stable step before anything has been looked for. A block lies on the floor under them.
TEST(SlidingFriction, ExplicitSchemesStepOnColliders)
{
    for (const char* scheme : {"symplectic_euler", "forward_euler"}) {
        const Sled sled{.lift = .012, .fps = 240, .frames = 12, .more = "[damping]\nstiffness = 0.001\n"};
        SceneRun run(sled.text(), {std::string("solver.integrator=\"") + scheme + "\"", "time.substeps=\"auto\""});
        run.toEnd();
        EXPECT_NEAR(mean(run.simulation, run.simulation.x()).y(), Sled::kHeight / 2 + .012, .02) << scheme;
    }
}

/// It slips by as much as what slides goes on for.
TEST_P(Friction, OfAConveyorCarriesAlong)
{
    constexpr double kSpeed = 1.5, kWithin = 0.01;
    Sled sled = GetParam().sled(1);
    sled.move = "{ velocity = [1.5, 0, 0] }";
    SceneRun run(sled.text());
    run.toEnd();
    const double slipped = kSpeed * 1 - mean(run.simulation, run.simulation.x()).x();
    EXPECT_NEAR(velocity(run.simulation).x(), kSpeed, 1e-3 * kSpeed);
    EXPECT_NEAR(slipped / (kSpeed * kSpeed / (2 * .3 * kG) - kSpeed / GetParam().fps / 2), 1, kWithin);
}

/// A bar that hits a wall with v: the pressure is rho c v for 2 L / c; then it leaves with -v.
TEST(Collider, SendsABarBackAsWavesDo)
{
    constexpr double kV = .1, kLength = 1, kWithin = .03;
    const double c = std::sqrt(kE / kDensity), mass = kDensity * kLength * .04;
    for (const std::string lattice : {"six", "five"}) {
        SceneRun run("version = 1\ngrid = { voxel_size = 0.025, lattice = \"" + lattice + "\" }\n" +
                     "[time]\nframes = [1, 600]\nfps = 1200\nsubsteps = 1\n[solver]\nintegrator = "
                     "\"midpoint\"\nnewton_tolerance = 1e-6\n[[body]]\nname = \"bar\"\nmaterial = \"gel\"\nshape = { "
                     "box = { size = [0.2, 1, 0.2], center = [0, 0.52, 0] } }\nvelocity = [0, -0.1, "
                     "0]\n[material.gel]\nyoungs_modulus = 1e5\npoisson_ratio = 0\ndensity = "
                     "1000\n[[collider]]\nfriction = 0\nshape = { halfspace = { normal = [0, -1, 0] } }\n");
        double first = 0, last = 0, impulse = 0, before = -kV, plateau = 0;
        int counted = 0;
        while (!run.atEnd()) {
            run.step();
            const double v = velocity(run.simulation).y(), t = run.simulation.time(),
                         force = mass * (v - before) * 1200;
            before = v;
            if (force > .5 * kDensity * c * kV * .04) {
                if (first == 0) first = t;
                last = t;
            }
            impulse += force / 1200;
            if (first > 0 && t > first + .05 && t < first + .15) plateau += force / .04, ++counted;
        }
        EXPECT_NEAR(plateau / counted / (kDensity * c * kV), 1, kWithin);
        EXPECT_NEAR((last - first) / (2 * kLength / c), 1, kWithin);
        EXPECT_NEAR(velocity(run.simulation).y() / kV, 1, kWithin);
        EXPECT_NEAR(impulse / (2 * mass * kV), 1, kWithin) << lattice;
    }
}

/// What pushes the lower half of a body up [N].
double pushFromBelow(core::Simulation& s)
{
    solver::Potential& potential = *s.stages().solve.back();
    std::vector<Vec3> gradient(s.x().size(), Vec3::Zero());
    potential.begin({s.x(), s.v(), std::numeric_limits<double>::infinity(), s.elastic(), s.time()});
    potential.evaluate(s.x(), gradient);
    double force = 0;
    for (std::size_t i = 0; i < gradient.size(); ++i)
        if (s.x()[i].y() < 0) force -= gradient[i].y();
    return force;
}

/// A ball of radius 1/10 m between two plates, static, pressed by `depth` of its radius: its force over that of Hertz,
/// F = 4/3 E / (1 - nu^2) sqrt(R) delta^1.5.
double pressedOverHertz(double depth, int cells, double nu, const std::string& lattice)
{
    constexpr double kR = .1, kSpeed = .01;  // m, m/s
    const double dx = kR / cells, delta = depth * kR;
    const auto plate = [&](double side) {
        return "[[collider]]\nfriction = 0\nshape = { halfspace = { normal = [0, " + number(side) +
               ", 0], offset = " + number(kR + kGap * dx) + " } }\nmove = { velocity = [0, " + number(-kSpeed * side) +
               ", 0] }\n";
    };
    SceneRun run("version = 1\nname = \"ball\"\n[time]\nframes = [1, 100]\nfps = " + number(kSpeed / delta * 2) +
                 "\nsubsteps = 1\n[grid]\nvoxel_size = " + number(dx) + "\nlattice = \"" + lattice +
                 "\"\n[solver]\nintegrator = \"static\"\n[[body]]\nname = \"ball\"\nmaterial = \"gel\"\n"
                 "shape = { sphere = { radius = 0.1 } }\n[material.gel]\nyoungs_modulus = 1e5\ndensity = 1000\n"
                 "poisson_ratio = " +
                 number(nu) + "\n" + plate(1) + plate(-1));
    run.toFrame(3);
    return pushFromBelow(run.simulation) / (4. / 3 * kE / (1 - nu * nu) * std::sqrt(kR) * std::pow(delta, 1.5));
}

TEST(Collider, PressesABallAsHertzSays)
{
    constexpr double kSolved = .02;   // there is no telling which of two is nearer
    constexpr double kShallow = .05;  // beyond, Hertz' theory of small contacts is itself off
    struct Pressed {
        double depth, nu;
        const char* lattice;
        double within[2];  // at 8 and 12 cells a radius
    };
    // At .02 a contact is as wide as one cell at 8 of them a radius.
    for (const auto& [depth, nu, lattice, bounds] : {Pressed{.02, .3, "six", {.3, .22}},
                                                     {.05, .3, "six", {.2, .14}},
                                                     {.1, .3, "six", {.2, .14}},
                                                     {.05, .49, "six", {.2, .14}},
                                                     {.05, .3, "five", {.2, .14}},
                                                     {.05, .49, "five", {.2, .14}}}) {
        double before = 1e9;
        for (int cells : {8, 12}) {
            const double ratio = pressedOverHertz(depth, cells, nu, lattice), within = bounds[cells > 8];
            const std::string of = number(depth) + ", " + number(nu) + ", " + lattice + ", " + std::to_string(cells);
            RecordProperty("F/Hertz at " + of, number(ratio));
            EXPECT_NEAR(ratio, 1, within) << of;
            if (depth <= kShallow) {
                EXPECT_LT(std::abs(ratio - 1), std::max(before, kSolved)) << of;
            }
            before = std::abs(ratio - 1);
        }
    }
}

}  // namespace
