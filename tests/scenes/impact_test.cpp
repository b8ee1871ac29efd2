// What collides and comes to rest, against closed forms.
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

using namespace vdbfrac;
using lab::SceneRun;

namespace {

constexpr double kE = 1e5, kDensity = 1000;  // Pa, kg/m^3

std::string number(double v) { return std::to_string(v); }

/// Bodies of one material.
struct Scene {
    double dx = 0.05, fps = 24;  // m, 1/s
    int frames = 24;
    double youngsModulus = kE, poissonRatio = 0;
    std::string integrator = "backward_euler", lattice = "six";
    std::string tables;  // of all else

    std::string text() const
    {
        return "version = 1\nname = \"impact\"\n[time]\nframes = [1, " + std::to_string(frames + 1) +
               "]\nfps = " + number(fps) + "\nsubsteps = 1\n[grid]\nvoxel_size = " + number(dx) + "\nlattice = \"" +
               lattice + "\"" + "\n[solver]\nintegrator = \"" + integrator +
               "\"\nnewton_tolerance = 1e-6\n[material.gel]\n" + "youngs_modulus = " + number(youngsModulus) +
               "\npoisson_ratio = " + number(poissonRatio) + "\ndensity = " + number(kDensity) + "\n" + tables;
    }
};

std::string box(const Vec3& size, const Vec3& center, double velocity)
{
    const auto list = [](const Vec3& v) {
        return "[" + number(v.x()) + ", " + number(v.y()) + ", " + number(v.z()) + "]";
    };
    return "[[body]]\nname = \"at" + number(center.y()) + "\"\nmaterial = \"gel\"\nvelocity = [0, " + number(velocity) +
           ", 0]\nshape = { box = { size = " + list(size) + ", center = " + list(center) + " } }\n";
}

/// Of the center of mass along y, of each body [m/s].
std::vector<double> speeds(const core::Simulation& s)
{
    std::vector<double> all;
    for (const core::Body& body : s.bodies()) {
        double momentum = 0, mass = 0;
        for (std::size_t i = body.firstNode; i < body.firstNode + body.mesh->nodeCount(); ++i)
            momentum += s.elastic().mass()[i] * s.v()[i].y(), mass += s.elastic().mass()[i];
        all.push_back(momentum / mass);
    }
    return all;
}

/// Speed of a point that backward Euler sends back from the contact's spring alone, over the one it came with. `omega`:
/// of the spring; its force grows by a square up to the depth `soft` [m].
double springRestitution(double omega, double dt, double apart, double speed, double soft)
{
    const auto pull = [&](double y) {  // m/s^2
        const double s = -y;
        return s <= 0 ? 0 : omega * omega * (s < soft ? s * s / (2 * soft) : s - soft / 2);
    };
    double y = apart, v = -speed;
    for (bool touched = false; !touched || y < 0;) {
        double low = v, high = speed;  // of the next speed: w = v + dt pull(y + dt w)
        for (int i = 0; i < 100; ++i) {
            const double w = .5 * (low + high);
            (w < v + dt * pull(y + dt * w) ? low : high) = w;
        }
        v = .5 * (low + high), y += dt * v, touched = touched || y < 0;
    }
    return v / speed;
}

/// A stiff block whose contact with a stiff plate, or a floor, is soft is a mass on a spring. With x = omega dt
/// backward Euler leaves (1 + x^2)^(-pi / (2 atan x)) of its speed, where that are many steps. On the plate the spring
/// is softer than that: the block's edges are amid cells, whose phi falls by half as much, so only short steps are
/// compared. On the floor it is wide: edges have less reach than faces.
TEST(Impact, BackwardEulerSendsAMassBackAsItDoesOnASpring)
{
    constexpr double kSpeed = .25, kHigh = .2, kStiffness = .005, kStiff = 1e6, kWithin = .03;  // m/s, m, 1, Pa
    const double k = kStiffness * kStiff / Scene{}.dx;                                          // Pa/m
    const double omega = std::sqrt(k / (kDensity * kHigh)), apart = .001;
    const auto block = [&](double wide, double aside) {
        return box({wide, kHigh, wide}, {aside, kHigh / 2 + apart, aside}, -kSpeed);
    };
    const std::string plate = "[contact]\nfriction = 0\nstiffness = " + number(kStiffness) + "\n" + block(.4, .025) +
                              box({.6, .1, .6}, {0, -.05, 0}, 0) +
                              "[[grip]]\nname = \"table\"\nbody = \"at-0.050000\"\nmove = { velocity = [0, 0, 0] }\n"
                              "region = { halfspace = { normal = [0, -1, 0], offset = 0.04 } }\n";
    const std::string floor =
        block(1.6, 0) + "[[collider]]\nshape = { halfspace = { normal = [0, -1, 0] } }\nfriction = 0\nstiffness = " +
        number(kStiffness) + "\n";
    const auto left = [&](double fps, const std::string& tables) {
        const int frames = int(std::ceil((std::numbers::pi / omega + .1) * fps)) + 8;
        SceneRun run(Scene{.fps = fps, .frames = frames, .youngsModulus = kStiff, .tables = tables}.text());
        run.toEnd();
        return speeds(run.simulation)[0] / kSpeed;
    };
    for (const double x : {.05, .1, .2, .5, 1.}) {
        // The block gives way too: its middle comes p H / (3 E) nearer.
        const double series = omega / std::sqrt(1 + k * kHigh / (3 * kStiff));
        const double spring = springRestitution(series, x / omega, apart, kSpeed, .02 * Scene{}.dx);
        EXPECT_NEAR(left(omega / x, floor) / spring, 1, kWithin) << x;
        if (x > .3) continue;
        EXPECT_NEAR(spring / std::pow(1 + x * x, -std::numbers::pi / (2 * std::atan(x))), 1, .006) << x;
        EXPECT_NEAR(left(omega / x, plate) / spring, 1, kWithin) << x;
    }
}

/// Of three equal bars in a row the last leaves with what the first came with.
TEST(Impact, OfACradleTheLastLeaves)
{
    constexpr double kSpeed = .05, kLength = .5, kWide = .1, kPassed = .95;
    std::string bars;
    for (int i = 0; i < 3; ++i) bars += box({kWide, kLength, kWide}, {0, i * (kLength + .001), 0}, i == 0 ? kSpeed : 0);
    for (const std::string lattice : {"six", "five"}) {
        SceneRun run(Scene{.dx = .025,
                           .fps = 1000,
                           .frames = 400,
                           .integrator = "midpoint",
                           .lattice = lattice,
                           .tables = "[contact]\nfriction = 0\n" + bars}
                         .text());
        run.toEnd();
        const std::vector<double> v = speeds(run.simulation);
        EXPECT_GT(v[2] * v[2], kPassed * kSpeed * kSpeed) << lattice;
        EXPECT_LT(std::abs(v[0]), .05 * kSpeed) << lattice;
        EXPECT_LT(std::abs(v[1]), .05 * kSpeed) << lattice;
    }
}

/// delta = (15 m v^2 / (16 E* sqrt R))^.4 at the most, F = 4/3 E* sqrt(R) delta^1.5; m / (dv/dt) tells F.
TEST(Impact, OfABallIsThatOfHertz)
{
    constexpr double kR = .1, kV = .1, kNu = .3, kWithin = .15, kDx = kR / 12;
    const double E = kE / (1 - kNu * kNu), m = 4. / 3 * std::numbers::pi * kR * kR * kR * kDensity,
                 delta = std::pow(15 * m * kV * kV / (16 * E * std::sqrt(kR)), .4), length = 2.94328 * delta / kV;
    constexpr double kFps = 480;
    for (const std::string lattice : {"six", "five"}) {
        SceneRun run(Scene{.dx = kDx,
                           .fps = kFps,
                           .frames = int(1.6 * .123 * kFps),
                           .poissonRatio = kNu,
                           .integrator = "midpoint",
                           .lattice = lattice,
                           .tables = "[[body]]\nname = \"ball\"\nmaterial = \"gel\"\nvelocity = [0, -0.1, 0]\n"
                                     "shape = { sphere = { radius = 0.1, center = [0, 0.103, 0] } }\n"
                                     "[[collider]]\nfriction = 0\nshape = { halfspace = { normal = [0, -1, 0] } }\n"}
                         .text());
        double before = -kV, greatest = 0, touched = 0, sunk = 0, fell = 0, deepest = 0;
        while (!run.atEnd()) {
            run.step();
            const double v = speeds(run.simulation)[0], force = m * (v - before) * kFps;
            fell += .5 * (v + before) / kFps, before = v;
            greatest = std::max(greatest, force), touched += force > .02 * greatest ? 1 / kFps : 0;
            if (greatest < .05) sunk = fell;
            deepest = std::max(deepest, sunk - fell);
        }
        EXPECT_NEAR(greatest / (4. / 3 * E * std::sqrt(kR) * std::pow(delta, 1.5)), 1, kWithin) << lattice;
        EXPECT_NEAR(deepest / delta, 1, kWithin) << lattice;
        EXPECT_NEAR(touched / length, 1, kWithin) << lattice;
        EXPECT_NEAR(before / kV, 1, kWithin) << lattice;
    }
}

/// What is dropped comes to rest: backward Euler damps at 24 steps a second, [damping] has to at 240.
TEST(Impact, WhatIsDroppedComesToRest)
{
    constexpr double kDrop = .1, kG = 9.81, kAtRest = 1e-5;
    for (double fps : {24., 240.})
        for (double nu : {.3, .49}) {
            SceneRun run(Scene{.fps = fps,
                               .frames = int(2.2 * fps),
                               .poissonRatio = nu,
                               .tables = box({.4, .2, .4}, {0, .1 + kDrop, 0}, 0) +
                                         "[gravity]\n[damping]\nstiffness = " + number(fps > 100 ? .005 : 0) +
                                         "\n[[collider]]\nshape = { halfspace = { normal = [0, -1, 0] } }\n"}
                             .text());
            run.toEnd();
            EXPECT_LT(run.steps.back().kineticEnergy, kAtRest * kDensity * .032 * kG * kDrop) << fps << " " << nu;
        }
}

}  // namespace
