// Colliders that are thin, narrow or far away: nothing comes through, and nothing is done for them in vain.
#include "sled.h"

#include <vdbfrac/base/atomic_file.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <unistd.h>

using namespace vdbfrac;
using namespace vdbfrac::test;
using lab::SceneRun;

namespace {

/// Nothing comes through a plate of less than a cell at five cells a frame, with steps of any kind.
TEST(Collider, LetsNothingThrough)
{
    const std::string plate = "[[collider]]\nshape = { box = { size = [2, 0.03, 2], center = [0, -0.4, 0] } }\n";
    for (const char* substeps : {"\"auto\"", "1"}) {
        std::string text = Sled{.gravity = {0, 0, 0}, .fps = 24, .frames = 20, .more = plate}.text();
        text.replace(text.find("velocity = [0.000000, 0, 0]"), 27, "velocity = [0, -6, 0]");
        text.replace(text.find("normal = [0, -1, 0]"), 19, "normal = [0, -1, 0], offset = 5");
        text.replace(text.find("substeps = 1"), 12, std::string("substeps = ") + substeps);
        SceneRun run(text);
        run.toEnd();
        // It has bounced off, and left nothing behind.
        for (const Vec3& x : run.simulation.x()) EXPECT_GT(x.y(), -.385) << substeps;
        EXPECT_GT(velocity(run.simulation).y(), 0) << substeps;
    }
}

/// Heights [m] at which a vertical line passes through the surface of a body.
std::vector<double> crossings(const core::Simulation& s, double x, double z)
{
    const tetmesh::EmbeddedSurface surface = s.bodies()[0].mesh->surface();
    std::vector<double> heights;
    for (const auto& t : surface.triangles) {
        const Vec3 A = surface.points[t[0]].at(s.x()), u = surface.points[t[1]].at(s.x()) - A,
                   v = surface.points[t[2]].at(s.x()) - A;
        const double area = u.x() * v.z() - u.z() * v.x(), dx = x - A.x(), dz = z - A.z();
        const double a = (dx * v.z() - dz * v.x()) / area, b = (u.x() * dz - u.z() * dx) / area;
        if (a >= 0 && b >= 0 && a + b <= 1) heights.push_back(A.y() + a * u.y() + b * v.y());
    }
    return heights;
}

/// A wire as thick as two voxels goes halfway down: between samples of a surface that it stretches it would come
/// through.
TEST(Collider, OfTwoVoxelsDoesNotPassBetweenSamples)
{
    constexpr double kWay = .3, kSpeed = .4;  // m, m/s
    const std::string scene =
        "version = 1\nname = \"wire\"\n[time]\nframes = [1, 19]\nfps = 24\n[grid]\nvoxel_size = 0.05\n"
        "[[body]]\nname = \"block\"\nmaterial = \"gel\"\nshape = { box = { size = [0.98, 0.58, 0.28], center = [0, "
        "0.3, "
        "0] } }\n[material.gel]\nyoungs_modulus = 5e4\npoisson_ratio = 0.4\ndensity = 1000\n[damping]\nstiffness = "
        "0.002\n[[collider]]\nshape = { halfspace = { normal = [0, -1, 0] } }\n"
        "[[collider]]\nfriction = 0.1\nshape = { cylinder = { axis = \"z\", radius = 0.05, height = 1, center = [0.01, "
        "0.68, 0] } }\nmove = { velocity = [0, -0.4, 0] }\n";
    SceneRun run(scene);
    run.toEnd();
    const double middle = .68 - kWay;
    ASSERT_NEAR(run.simulation.time() * kSpeed, kWay, 1e-9);
    EXPECT_GT(run.work.countOf("collider", "edge_points"), 0);
    for (double z : {-.0869, .0131, .0969})
        for (double y : crossings(run.simulation, .0113, z)) EXPECT_LT(y, middle) << z;
}

/// What goes along with a thin plate does not pass it, wherever a scheme takes its forces.
TEST(Collider, StepsThatGoAlongWithAPlateAreKept)
{
    const std::string plate =
        "[[collider]]\nfriction = 0\nshape = { box = { size = [2, 0.04, 2], center = [0, -0.02, 0] } }\n"
        "move = { velocity = [0, -2, 0] }\n";
    for (const char* scheme : {"backward_euler", "midpoint", "sdirk2"}) {
        std::string text = Sled{.gravity = Vec3::Zero(),
                                .friction = 0,
                                .frames = 3,
                                .solver = "integrator = \"" + std::string(scheme) + "\"\n",
                                .more = plate}
                               .text();
        text.replace(text.find("velocity = [0.000000, 0, 0]"), 27, "velocity = [0, -2, 0]");
        text.replace(text.find("normal = [0, -1, 0]"), 19, "normal = [0, -1, 0], offset = 9");
        SceneRun run(text);
        run.toEnd();
        for (const core::StepRecord& s : run.steps) EXPECT_EQ(s.cutbacks, 0) << scheme;
        EXPECT_NEAR(velocity(run.simulation).y(), -2, .01) << scheme;
    }
}

/// What rests on a floor, and what has a collider from a file far away, has no points but its samples.
TEST(Collider, LooksAtEdgesThatAreStretchedAndNearAlone)
{
    const std::string mesh =
        (std::filesystem::temp_directory_path() / ("vdbfrac_far_" + std::to_string(getpid()) + ".obj")).string();
    writeText(mesh, "v 8 0 0\nv 9 0 0\nv 8 1 0\nv 8 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    const std::string far = "[[collider]]\nshape = { mesh = { file = \"" + mesh + "\" } }\n";
    for (const char* lattice : {"six", "five", "delaunay"}) {
        SceneRun still(Sled{.lattice = lattice, .more = far}.text());
        for (int i = 0; i < 3; ++i) EXPECT_EQ(still.step().work.countOf("collider", "edge_points"), 0) << lattice;
        EXPECT_GT(still.steps.back().work.countOf("collider", "active"), 0);
    }
    // A spin draws it out.
    std::string text = Sled{.gravity = Vec3::Zero(), .lift = 1, .youngsModulus = 1e3, .more = far}.text();
    text.replace(text.find("velocity = "), 0, "angular_velocity = [0, 12, 0]\n");
    SceneRun spun(text);
    for (int i = 0; i < 6; ++i) EXPECT_EQ(spun.step().work.countOf("collider", "edge_points"), 0);
    double longest = 0;
    const tetmesh::EmbeddedSurface surface = spun.simulation.bodies()[0].mesh->surface();
    for (const auto& t : surface.triangles)
        longest = std::max(
            longest,
            (surface.points[t[0]].at(spun.simulation.x()) - surface.points[t[1]].at(spun.simulation.x())).norm());
    EXPECT_GT(longest, 1.5 * std::sqrt(2) * Sled::kDx);
    std::filesystem::remove(mesh);
}

/// Where nothing moves by itself, what a collider that presses puts in is what the block and the touch hold: its forces
/// grow along its way. Not in the first step, in which the block comes to rest.
TEST(Collider, WorkOfOneThatMovesIsThatOfItsForcesOnTheWay)
{
    constexpr double kWithin = .01;
    for (int substeps : {1, 8}) {
        Sled sled{.gravity = Vec3::Zero(), .friction = 0, .frames = 3, .solver = "integrator = \"static\"\n"};
        sled.more =
            "[[collider]]\nfriction = 0\nshape = { box = { size = [2, 0.2, 2], center = [0, 0.31, 0] } }\n"
            "move = { velocity = [0, -0.2, 0] }\n";
        std::string text = sled.text();
        text.replace(text.find("substeps = 1"), 12, "substeps = " + std::to_string(substeps));
        SceneRun run(text);
        run.step();
        double held = run.simulation.totals().elasticEnergy;
        while (run.simulation.framesDone() < 3) {
            const core::StepRecord& s = run.step();
            const double gain = run.simulation.totals().elasticEnergy - held, work = s.energyFlow.at("collider_work");
            EXPECT_NEAR(work / gain, 1, kWithin) << substeps;
            held += gain;
        }
        EXPECT_GT(held, 15);
    }
}

}  // namespace
