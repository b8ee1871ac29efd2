// What touches what: a body that carries another along, one that folds onto itself, a floor that is a level set.
#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/grid/body_level_set.h>
#include <vdbfrac/grid/vdb_file.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <string>
#include <utility>

#include <unistd.h>

using namespace vdbfrac;
using lab::SceneRun;

namespace {

constexpr double kDx = 0.05, kG = 9.81;  // m, m/s^2

std::string header(const char* lattice, int fps, int frames, const char* youngsModulus = "1e5")
{
    return "version = 1\nname = \"touching\"\n[time]\nframes = [1, " + std::to_string(frames + 1) +
           "]\nfps = " + std::to_string(fps) + "\nsubsteps = 1\n[grid]\nvoxel_size = 0.05\nlattice = \"" + lattice +
           "\"\n[solver]\nnewton_tolerance = 1e-6\nlinear_tolerance = 1e-5\n[material.gel]\nyoungs_modulus = " +
           youngsModulus +
           "\n"
           "poisson_ratio = 0.3\ndensity = 1000\n[damping]\nstiffness = 0.01\n";
}

const core::Body& bodyOf(const core::Simulation& s, const std::string& name)
{
    return *std::find_if(s.bodies().begin(), s.bodies().end(), [&](const core::Body& b) { return b.name == name; });
}

/// Means over the mass of a body.
Vec3 mean(const core::Simulation& s, std::span<const Vec3> of, const std::string& name)
{
    const core::Body& body = bodyOf(s, name);
    Vec3 sum = Vec3::Zero();
    double total = 0;
    for (std::size_t i = body.firstNode; i < body.firstNode + body.mesh->nodeCount(); ++i)
        sum += s.elastic().mass()[i] * of[i], total += s.elastic().mass()[i];
    return sum / total;
}

class TouchingOn : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Lattices, TouchingOn, testing::Values("six", "five", "delaunay"));

/// A block on a slab that moves on at a speed slips by V^2 / (2 mu g), as on a collider that does, less V dt / 2 by
/// backward Euler. Not on lattices of five: there its edges, sharp and straight along nodes, catch in the slab at
/// first.
void expectCarriedAlong(const char* lattice)
{
    constexpr double kSpeed = .6, kFriction = .3, kWithin = .03;  // m/s
    constexpr int kFps = 96;
    const std::string scene =
        header(lattice, kFps, kFps / 2, "1e6") +
        "[gravity]\n[contact]\nfriction = 0.3\n"
        "[[body]]\nname = \"slab\"\nmaterial = \"gel\"\nshape = { box = { size = [1, 0.1, 0.5], center = [0, -0.05, "
        "0] } }\nvelocity = [0.6, 0, 0]\n"
        "[[grip]]\nbody = \"slab\"\nregion = { halfspace = { normal = [0, -1, 0], offset = 0.03 } }\n"
        "move = { velocity = [0.6, 0, 0] }\n"
        "[[body]]\nname = \"block\"\nmaterial = \"gel\"\nshape = { box = { size = [0.3, 0.2, 0.3], center = [0, 0.1, "
        "0] } }\n";
    SceneRun run(scene);
    const Vec3 start = mean(run.simulation, run.simulation.x(), "block");
    run.toEnd();
    const core::Simulation& s = run.simulation;
    EXPECT_NEAR(mean(s, s.v(), "block").x() / kSpeed, 1, .01) << lattice;
    const double slipped = kSpeed * s.time() - (mean(s, s.x(), "block") - start).x();
    EXPECT_NEAR(slipped / (kSpeed * kSpeed / (2 * kFriction * kG) - kSpeed / kFps / 2), 1, kWithin) << lattice;
}

TEST(Touching, ABodyCarriesAnotherAlongByFriction)
{
    for (const char* lattice : {"six", "delaunay"}) expectCarriedAlong(lattice);
}

/// How near the two arms of a body with a slot come to each other, one above the other [m], when they are pressed
/// together by more than the slot is wide; with what force in the end [N]; and how deep they are told to be in each
/// other, and in other fragments [m].
struct Arms {
    double gap = 1e9, load = 0, inItself = 0, inOthers = 0;

    Arms(const char* lattice, const std::string& contact)
    {
        std::string scene =
            header(lattice, 24, 24) + contact +
            "[[body]]\nname = \"fork\"\nmaterial = \"gel\"\nshape = { box = { size = [1, 0.6, 0.3] } }\n"
            "cut = [{ box = { size = [0.8, 0.1, 1], center = [0.2, 0, 0] } }]\n";
        for (const char* sign : {"", "-"})
            scene += std::string("[[grip]]\nbody = \"fork\"\nregion = { halfspace = { normal = [0, ") + sign +
                     "1, 0], offset = 0.28 } }\nmove = { velocity = [0, " + (*sign ? "" : "-") + "0.08, 0] }\n";
        SceneRun run(scene);
        const tetmesh::EmbeddedSurface surface = run.simulation.bodies()[0].mesh->surface();
        const std::vector<Vec3> rest = tetmesh::restPositions(*run.simulation.bodies()[0].mesh);
        while (!run.atEnd()) {
            core::StepRecord r = run.step();
            load = r.gripLoad[0].norm();
            inItself = std::max(inItself, r.measured["contact_self_depth_m"]);
            inOthers = std::max(inOthers, r.measured["contact_depth_m"]);
            std::map<std::pair<long, long>, std::pair<double, double>> column;  // lowest above, highest below
            for (const tetmesh::EmbeddedPoint& p : surface.points) {
                const Vec3 X = p.at(rest), x = p.at(run.simulation.x());
                if (X.x() < 0 || X.x() > .45 || std::abs(X.z()) > .1 || std::abs(X.y()) > .06) continue;
                auto& [above, below] =
                    column.try_emplace({std::lround(X.x() / kDx), std::lround(X.z() / kDx)}, 1., -1.).first->second;
                (X.y() > 0 ? above : below) = X.y() > 0 ? std::min(above, x.y()) : std::max(below, x.y());
            }
            for (const auto& [place, faces] : column) gap = std::min(gap, faces.first - faces.second);
        }
    }
};

TEST_P(TouchingOn, TheArmsOfABodyDoNotPassThroughEachOther)
{
    const Arms touching(GetParam(), "[contact]\n"), free(GetParam(), "");
    std::printf("%s: gap %.3f voxels, told %.3f, %.1f N; without contact %.2f, %.1f N\n", GetParam(),
                touching.gap / kDx, touching.inItself / kDx, touching.load, free.gap / kDx, free.load);
    EXPECT_GT(touching.gap, -.1 * kDx);
    EXPECT_NEAR(touching.inItself, -touching.gap, .03 * kDx);
    EXPECT_EQ(touching.inOthers, 0);
    EXPECT_LT(free.gap, -.5 * kDx);
    EXPECT_GT(touching.load, 1.2 * free.load);
}

/// A block that falls onto a box lies where it lies on the same box as a level set, read from a file.
TEST(Touching, ALevelSetCarriesAsTheSolidThatItIsOf)
{
    const std::filesystem::path file =
        std::filesystem::temp_directory_path() / ("vdbfrac-table-" + std::to_string(::getpid()) + ".vdb");
    scene::Body table;
    table.shape = Primitive{.center = Vec3(0, -.2, 0), .size = Vec3(1, .3, 1)};
    scene::Grid grid;
    grid.voxelSize = kDx;
    const grid::LevelSet phi = grid::makeLevelSet(table, grid, std::uint64_t(1) << 30);
    grid::writeVdb(file, {{.name = "surface", .levelSet = &phi, .values = {}, .unit = "m"}}, {});
    const auto rest = [&](const std::string& shape) {
        SceneRun run(header("six", 24, 30) + "[gravity]\n[[collider]]\nshape = " + shape +
                     "\n[[body]]\nname = \"block\"\nmaterial = \"gel\"\nshape = { box = { size = [0.4, 0.2, 0.4], "
                     "center = [0, 0.07, 0] } }\n");
        run.toEnd();
        EXPECT_GT(run.work.countOf("solve", "couplings"), 0) << shape;
        return mean(run.simulation, run.simulation.x(), "block");
    };
    const Vec3 solid = rest("{ box = { size = [1, 0.3, 1], center = [0, -0.2, 0] } }");
    const Vec3 ofFile = rest("{ vdb = \"" + file.string() + "\" }");
    EXPECT_LT((ofFile - solid).norm(), .02 * kDx) << ofFile.transpose() << "; " << solid.transpose();
    std::filesystem::remove(file);
}

}  // namespace
