// Meshes of tets of any shape, cut by phi.
#include "carrying.h"
#include "mesh_checks.h"
#include "surface_checks.h"
#include "tets_of_box.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/lab/samples/block.h>
#include <vdbfrac/lab/samples/surface_measures.h>
#include <vdbfrac/tetmesh/cut_tet_mesh.h>

#include <gtest/gtest.h>

#include <numeric>
#include <random>

using namespace vdbfrac;
using test::ballAt;
using test::boxAt;
using test::Changes;
using test::hollow;
using test::Phi;
using test::raised;
using tetmesh::CutMesh;
using tetmesh::CutTetMesh;
using tetmesh::TetMesh;

namespace {

constexpr double dx = .1;
constexpr double kSums = 1e-12;  // relative rounding of sums over some thousand pieces

CutTetMesh cut(int reach, const Phi& solid, double shake = .2, int m = 1)
{
    return CutTetMesh(test::tetsOfBox(reach, m, shake, dx), m * dx, dx,
                      lab::sample({-reach, -reach, -reach}, {reach, reach, reach}, dx, solid));
}

void expectSame(const CutTetMesh& a, const CutTetMesh& b)
{
    ASSERT_EQ(a.firstNode(), b.firstNode());
    ASSERT_EQ(a.elements().size(), b.elements().size());
    for (std::size_t e = 0; e < a.elements().size(); ++e) {
        ASSERT_EQ(a.elements()[e].node, b.elements()[e].node) << e;
        ASSERT_EQ(a.elements()[e].fraction, b.elements()[e].fraction) << e;
        ASSERT_EQ(a.elements()[e].patch, b.elements()[e].patch) << e;
        ASSERT_EQ(a.gradients()[e], b.gradients()[e]) << e;
    }
    const auto s = a.surface(), t = b.surface();
    ASSERT_EQ(s.triangles, t.triangles);
    ASSERT_EQ(s.cutArea, t.cutArea);
    for (std::size_t i = 0; i < s.points.size(); ++i)
        ASSERT_TRUE(s.points[i].node == t.points[i].node && s.points[i].weight == t.points[i].weight);
}

TEST(CutTetMesh, OfTheTetsOfALatticeIsTheCutLattice)
{
    const Phi solid = ballAt({.013, .021, -.037}, .63), crack = hollow(boxAt({0, .02, 0}, {.5, .11, 2}));
    CutTetMesh tets = cut(9, solid, 0);
    CutMesh lattice({tetmesh::Lattice::Kind::six, 1, dx}, lab::sample({-9, -9, -9}, {9, 9, 9}, dx, solid));
    for (int pass = 0; pass < 2; ++pass) {
        EXPECT_EQ(tets.nodeCount(), lattice.nodeCount());
        EXPECT_NEAR(tets.volume(), lattice.volume(), kSums * lattice.volume());
        EXPECT_NEAR(tets.surface().cutArea, lattice.surface().cutArea, kSums * lattice.surface().cutArea);
        EXPECT_EQ(test::fragmentCount(tets), test::fragmentCount(lattice));
        EXPECT_EQ(tets.surface().triangles.size(), lattice.surface().triangles.size());
        const Changes changes = raised(tets, {-9, -9, -9}, {9, 9, 9}, crack);
        tets.update(changes), lattice.update(changes);
    }
    EXPECT_GT(test::fragmentCount(tets), 0u);
}

TEST(CutTetMesh, SurfaceIsClosedOrientedAndEnclosesTheVolume)
{
    for (const Phi& solid :
         {ballAt({.01, .02, -.03}, .7), boxAt({.013, -.021, .037}, {.6, .5, .4}), test::torus(.5, .22)}) {
        const CutTetMesh mesh = cut(10, solid);
        test::expectClosed(mesh);
        EXPECT_NEAR(lab::enclosedVolume(mesh), mesh.volume(), kSums * mesh.volume());
        EXPECT_EQ(test::fragmentCount(mesh), 1u);
    }
}

TEST(CutTetMesh, VolumeOfABallConvergesInSecondOrder)
{
    const auto error = [](int across) {
        const double step = 1.4 / across;  // phi is resampled on finer voxels; the mesh scales with them
        const int reach = across / 2 + 3;
        TetMesh tets = test::tetsOfBox(reach, 1, .2, dx);
        for (Vec3& p : tets.points) p *= step / dx;
        const CutTetMesh mesh(
            tets, step, step,
            lab::sample({-reach, -reach, -reach}, {reach, reach, reach}, step, ballAt({.01, .02, -.03}, .6)));
        const double exact = 4. / 3 * M_PI * std::pow(.6, 3);
        return std::abs(mesh.volume() - exact) / exact;
    };
    EXPECT_GT(std::log2(error(8) / error(16)), 1.7);
}

TEST(CutTetMesh, CarriesValuesAndPointsThroughSixtyCuts)
{
    CutTetMesh mesh = cut(8, ballAt(Vec3(.01, .02, -.03), .6));
    test::expectCarried(mesh, 8);
}

TEST(CutTetMesh, UpdateEqualsFreshCutToTheBit)
{
    CutTetMesh mesh = cut(8, ballAt(Vec3(.01, .02, -.03), .6));
    const TetMesh tets = test::tetsOfBox(8, 1, .2, dx);
    std::mt19937 random(12);
    std::uniform_real_distribution<double> place(-.8, .8), size(.05, .35);
    for (int round = 0; round < 15; ++round) {
        const double x = place(random), y = place(random), z = place(random);
        const Changes changes = raised(mesh, {-12, -12, -12}, {12, 12, 12}, hollow(ballAt({x, y, z}, size(random))));
        const std::vector<Vec3> oldPlaces = tetmesh::restPositions(mesh);
        const auto update = mesh.update(changes);
        ASSERT_EQ(update.previousNode.size(), mesh.nodeCount());
        for (std::size_t i = 0; i < mesh.nodeCount(); ++i)
            ASSERT_EQ(oldPlaces[update.previousNode[i]], mesh.restPosition(i));
        expectSame(mesh, CutTetMesh(tets, dx, dx, mesh.phi()));
        if (HasFatalFailure()) return;
    }
    test::expectClosed(mesh);
}

TEST(CutTetMesh, SplitKeepsTheMassOfEveryParent)
{
    CutTetMesh mesh = cut(8, boxAt({.013, -.021, .037}, {.5, .4, .5}));
    std::vector<double> before = test::lumpedMass(mesh);
    const auto update = mesh.update(raised(mesh, {-8, -8, -8}, {8, 8, 8}, hollow(boxAt({0, .03, 0}, {2, .06, 2}))));
    EXPECT_TRUE(update.topologyChanged);
    EXPECT_EQ(test::fragmentCount(mesh), 2u);
    std::vector<double> after(before.size(), 0);
    const std::vector<double> now = test::lumpedMass(mesh);
    for (std::size_t i = 0; i < now.size(); ++i) after[update.previousNode[i]] += now[i];
    for (std::size_t i = 0; i < after.size(); ++i) EXPECT_LE(after[i], before[i] * (1 + kSums)) << i;
    test::expectClosed(mesh);
}

TEST(CutTetMesh, NodalSharesAddUpToTheMaterial)
{
    const CutTetMesh mesh = cut(9, ballAt({.01, .02, -.03}, .6), .2, 3);
    double volume = 0, energy = 0;
    const auto density = [](std::uint32_t e, int) { return 1. + e % 5; };
    for (int z = -12; z <= 12; ++z)
        for (int y = -12; y <= 12; ++y)
            for (int x = -12; x <= 12; ++x) {
                const tetmesh::NodalShare share = mesh.nodalShare({x, y, z}, density);
                volume += share.volume, energy += share.energy;
            }
    double expected = 0;
    for (std::uint32_t e = 0; e < mesh.elements().size(); ++e)
        expected += mesh.volume(mesh.elements()[e]) * density(e, 0);
    constexpr double kSingle = 1e-6;  // weights are kept in single precision
    EXPECT_NEAR(volume * dx * dx * dx, mesh.volume(), kSingle * mesh.volume());
    EXPECT_NEAR(energy * dx * dx * dx, expected, kSingle * expected);
}

TEST(CutTetMesh, NodalShareOfALinearFieldIsThatOfTheVoxel)
{
    // Deep inside, sum of weights = 1 and the mean of a field that is linear over the tets is its value at the voxel.
    const CutTetMesh mesh = cut(9, boxAt({0, 0, 0}, {.8, .8, .8}), .2, 2);
    std::vector<double> density;
    for (const auto& e : mesh.elements()) {
        Vec3 middle = Vec3::Zero();
        for (std::size_t a = 0; a < 4; ++a) middle += .25 * mesh.restPosition(e.node[a]);
        density.push_back(2 + middle.x() - middle.z());
    }
    constexpr double kQuadrature = .01,
                     kPiecewise = .08;  // half a voxel wide sub-tets; constant within tets two voxels wide
    for (Coord c : {Coord{0, 0, 0}, Coord{1, 2, -3}, Coord{-4, 1, 2}}) {
        const auto share = mesh.nodalShare(c, [&](std::uint32_t e, int) { return density[e]; });
        EXPECT_NEAR(share.volume, 1, kQuadrature);
        EXPECT_NEAR(share.energy / share.volume, 2 + dx * (c.x - c.z), kPiecewise);
    }
}

TEST(CutTetMesh, VoxelsAboveAreThoseThatATetAboveBelongsTo)
{
    const CutTetMesh mesh = cut(6, ballAt({.01, .02, -.03}, .4));
    std::vector<double> density(mesh.elements().size() * tetmesh::kMaxTets, 0.);
    for (std::size_t e = 0; e < mesh.elements().size(); e += 97) density[e * tetmesh::kMaxTets] = 2;
    const auto energy = [&](std::uint32_t e, int) { return density[e * tetmesh::kMaxTets]; };
    std::vector<Coord> expected;
    for (int z = -8; z <= 8; ++z)
        for (int y = -8; y <= 8; ++y)
            for (int x = -8; x <= 8; ++x)
                if (mesh.nodalShare({x, y, z}, energy).energy > 0) expected.push_back({x, y, z});
    EXPECT_EQ(mesh.voxelsAbove(density, 1.5), expected);
}

TEST(CutTetMesh, SameBitsForAnyNumberOfThreads)
{
    const auto make = [](int threads) {
        const ThreadLimit limit(threads);
        CutTetMesh mesh = cut(8, ballAt({.01, .02, -.03}, .6));
        mesh.update(raised(mesh, {-8, -8, -8}, {8, 8, 8}, hollow(boxAt({0, .03, 0}, {2, .06, 2}))));
        return mesh;
    };
    const CutTetMesh one = make(1);
    for (int threads : {2, 3}) expectSame(one, make(threads));
}

TEST(CutTetMesh, MaterialAtTheBoundaryIsAnError) { EXPECT_THROW(cut(5, ballAt({0, 0, 0}, .7)), InputError); }

}  // namespace
