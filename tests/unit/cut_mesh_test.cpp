// The cut mesh: volume, surface, and updates that equal a fresh cut.
#include "lattices.h"
#include "surface_checks.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/lab/samples/surface_measures.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <vector>

using namespace vdbfrac;
using test::ballAt;
using test::boxAt;
using test::cellsTouched;
using test::Changes;
using test::expectSame;
using test::fragmentCount;
using test::hollow;
using test::lumpedMass;
using test::Phi;
using test::raised;
using test::sum;
using test::torus;
using tetmesh::CellElement;
using tetmesh::CutMesh;
using tetmesh::Lattice;

namespace {

constexpr double kSums = 1e-12;  // relative: rounding of sums over some thousand pieces

class CutMeshes : public test::Lattices {};
INSTANTIATE_TEST_SUITE_P(All, CutMeshes, test::kLattices, test::nameOfLattice);

TEST_P(CutMeshes, SurfaceIsClosedOrientedAndEnclosesTheVolume)
{
    const Vec3 off(.013, -.021, .037);  // no symmetry with the grid
    for (const Phi& phi : {ballAt(off, .83), boxAt(off, {.7, .5, .36}), torus(.6, .23)}) {
        const CutMesh mesh = cut(11, phi);
        test::expectClosed(mesh);
        EXPECT_NEAR(lab::enclosedVolume(mesh), mesh.volume(), kSums * mesh.volume());
    }
}

TEST_P(CutMeshes, FractionsLieBetweenZeroAndOneAndElementsAreWhole)
{
    const CutMesh mesh = cut(11, torus(.6, .23));
    for (const auto& cell : mesh.cells()) {
        double pieces = 0, elements = 0;
        const auto& stencil = mesh.stencil(mesh.lattice().shapeOf(cell.coord));
        const auto& tets = tetmesh::cellTets(mesh.lattice().shapeOf(cell.coord));
        for (const auto& piece : cell.pieces) {
            EXPECT_GT(piece.cut.fraction, 0);
            EXPECT_LE(piece.cut.fraction, 1);
            // Sub-tets of a Kuhn tet all have the same size; five tets are not subdivided.
            pieces += tets.volume[stencil.subTets[piece.subTet].parent] * piece.cut.fraction /
                      std::pow(mesh.lattice().coarsening, 3);
        }
        for (std::uint32_t e = 0; e < cell.elements; ++e) {
            const CellElement& element = mesh.elements()[cell.firstElement + e];
            for (double f : element.fraction) EXPECT_TRUE(f >= 0 && f <= 1);
            for (std::uint32_t n : element.node) EXPECT_LT(n, mesh.nodeCount());
            for (int t = 0; t < tets.count; ++t) {
                elements += tets.volume[std::size_t(t)] * element.fraction[std::size_t(t)];
                if (element.fraction[std::size_t(t)] == 0) continue;
                for (int c : tets.corner[std::size_t(t)])
                    EXPECT_EQ(mesh.nodes()[element.node[std::size_t(c)]],
                              cell.coord + Coord({c & 1, c >> 1 & 1, c >> 2 & 1}));
            }
        }
        EXPECT_NEAR(cell.whole ? 1 : pieces, elements, kSums);
    }
}

TEST_P(CutMeshes, SubTetsNestInTheirParents)
{
    constexpr double kRounding = 1e-14;
    for (int parity = 0; parity < 2; ++parity) {
        const auto shape = GetParam().shapeOf({parity, 0, 0});
        const auto& tets = tetmesh::cellTets(shape);
        const auto stencil = tetmesh::makeCellStencil(GetParam(), shape);
        EXPECT_EQ(int(stencil.subTets.size()), tets.count * int(std::pow(GetParam().coarsening, 3) + .5));
        for (const auto& sub : stencil.subTets)
            for (std::uint16_t v : sub.vertex) {
                const Vec3 p = stencil.vertices[v].toVec() / GetParam().coarsening;
                for (std::size_t a = 0; a < 4; ++a) {
                    const auto& g = tets.gradient[sub.parent][a];
                    const int c0 = tets.corner[sub.parent][0];
                    const Vec3 d = p - Vec3(c0 & 1, c0 >> 1 & 1, c0 >> 2 & 1);
                    const double bary = (a == 0) + Vec3(g[0], g[1], g[2]).dot(d);
                    EXPECT_GE(bary, -kRounding);
                    EXPECT_LE(bary, 1 + kRounding);
                }
            }
    }
}

TEST_P(CutMeshes, PlanesThroughNodesEdgesAndFacesAreClean)
{
    const auto expectClean = [](const CutMesh& mesh) {
        test::expectClosed(mesh);
        EXPECT_NEAR(lab::enclosedVolume(mesh), mesh.volume(), kSums * mesh.volume());
    };
    // Faces on coordinate planes of nodes: phi is exactly 0 there.
    expectClean(cut(8, boxAt(Vec3::Zero(), {.4, .3, .5})));
    // The same with values in steps of dx: along the box' edges whole tets have no corner but zeros.
    expectClean(cut(8, [](Vec3 p) { return dx * std::round((p.cwiseAbs() - Vec3(.6, .4, .5)).maxCoeff() / dx); }));
    // Half of a cube, cut by planes through nodes, edges, faces and diagonals of the grid, exactly and nearly so.
    for (const Vec3& n : {Vec3(1, 0, 0), Vec3(0, 1, 1), Vec3(1, -1, 0), Vec3(1, 1, 1), Vec3(2, -1, 0), Vec3(1, 2, -3)})
        for (double shift : {0., 1e-9, -1e-9, 1e-7, -1e-7})
            expectClean(cut(8, [&](Vec3 p) {
                const double plane = std::round(n.dot(p) / dx) * dx / n.norm() + shift * dx;
                return std::max(plane, p.cwiseAbs().maxCoeff() - .5);
            }));
}

TEST_P(CutMeshes, CracksWithoutWidthAreClean)
{
    // Nodes that are exactly 0 amid material: a crack whose two faces lie on each other, closed along its front. `wide`
    // rows of nodes in the plane x = 0; the widest reaches the outside.
    for (int wide : {1, 2, 3, 4, 20}) {
        const CutMesh mesh = cut(8, [&](Vec3 p) {
            const Coord c{int(std::lround(p.x() / dx)), int(std::lround(p.y() / dx)), int(std::lround(p.z() / dx))};
            const bool crack = c.x == 0 && c.y >= 0 && c.y < wide && std::abs(c.z) <= 3;
            return crack ? 0 : p.cwiseAbs().maxCoeff() - .63;
        });
        SCOPED_TRACE(wide);
        test::expectClosed(mesh);
        EXPECT_NEAR(lab::enclosedVolume(mesh), mesh.volume(), kSums * mesh.volume());
    }
}

TEST_P(CutMeshes, PlanesAnywhereCutTheExactVolume)
{
    constexpr double kVolume = 1e-6;  // |phi| below 1e-6 dx counts as 0; phi itself is a float
    // Linear interpolation rounds off edges and corners. It does so alike in boxes whose lengths differ by two voxels
    // (the period of the five-tet lattice), so the mixed difference of four boxes is a column without ends.
    for (double low : {-.2, -.2 + 3e-8, -.213})
        for (double high : {.3, .3 - 3e-8, .341}) {
            const auto volumeOf = [&](double x, double y) {
                return cut(10,
                           [&](Vec3 p) {
                               return std::max({low - p.z(), p.z() - high, std::abs(p.x()) - x, std::abs(p.y()) - y});
                           })
                    .volume();
            };
            const double column = volumeOf(.83, .79) - volumeOf(.63, .79) - volumeOf(.83, .59) + volumeOf(.63, .59);
            EXPECT_NEAR(column, .4 * .4 * (high - low), kVolume);
        }
}

TEST_P(CutMeshes, UpdateEqualsFreshCutToTheBit)
{
    CutMesh mesh = cut(10, ballAt(Vec3(.01, .02, -.03), .9));
    std::mt19937 random(12);
    std::uniform_real_distribution<double> place(-.8, .8), size(.05, .35);
    for (int round = 0; round < 60; ++round) {
        const double x = place(random), y = place(random), z = place(random);
        const Changes changes = raised(mesh, {-12, -12, -12}, {12, 12, 12}, hollow(ballAt({x, y, z}, size(random))));
        const std::int64_t expected = cellsTouched(mesh, changes);
        const std::vector<Coord> oldNodes = mesh.nodes();
        const auto update = mesh.update(changes);
        EXPECT_EQ(update.cutCells, expected) << round;
        if (update.changedVoxels > 0) {
            ASSERT_EQ(update.previousNode.size(), mesh.nodeCount());
            for (std::size_t i = 0; i < mesh.nodeCount(); ++i) {
                ASSERT_LT(update.previousNode[i], oldNodes.size());
                ASSERT_EQ(oldNodes[update.previousNode[i]], mesh.nodes()[i]);
            }
        }
        expectSame(mesh, CutMesh(GetParam(), mesh.phi()));
        if (HasFatalFailure()) return;
        if (round % 10 == 0) {
            test::expectClosed(mesh);
            if (!mesh.elements().empty()) {
                EXPECT_NEAR(lab::enclosedVolume(mesh), mesh.volume(), kSums * (mesh.volume() + 1e-3));
            }
        }
    }
}

TEST_P(CutMeshes, WorkOfAnUpdateIsThatOfItsChangeHoweverLargeTheMesh)
{
    const auto hole = hollow(ballAt({.31, -.12, .07}, .22));
    const auto work = [&](double half) {
        const int reach = int(half / dx) + 2;
        CutMesh mesh = cut(reach, boxAt(Vec3(.013, -.021, .037), {half, half, half}));
        const auto update = mesh.update(raised(mesh, {-2, -6, -4}, {8, 4, 5}, hole));
        return std::array<std::int64_t, 5>{update.changedVoxels, update.cutCells, update.classifiedNodes,
                                           update.groupedCells, std::int64_t(mesh.cells().size())};
    };
    const auto small = work(1.4), large = work(2.2);
    EXPECT_GT(large[4], 3 * small[4]);
    EXPECT_GT(small[3], 0);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(small[i], large[i]) << i;
}

TEST_P(CutMeshes, CellsThatStayWholeAreNotPutTogetherAgain)
{
    CutMesh mesh = cut(8, ballAt(Vec3(.01, .02, -.03), .7));
    const CutMesh before = mesh;
    const auto update = mesh.update(Changes{{{0, 0, 0}, -.05f}});  // was deeper, and is inside still
    EXPECT_GT(update.cutCells, 0);
    EXPECT_EQ(update.groupedCells, 0);
    EXPECT_FALSE(update.topologyChanged);
    EXPECT_EQ(mesh.nodes(), before.nodes());
    expectSame(mesh, CutMesh(GetParam(), mesh.phi()));
}

TEST_P(CutMeshes, UpdatesHaveTheSameBitsForAnyNumberOfThreads)
{
    const auto tear = [&](int threads) {
        const ThreadLimit limit(threads);
        CutMesh mesh = cut(10, ballAt(Vec3(.01, .02, -.03), .9));
        for (double x : {-.5, -.2, .1, .4})
            mesh.update(raised(mesh, {-12, -12, -12}, {12, 12, 12}, hollow(boxAt({x, .3 * x, .1}, {.06, .5, 1.2}))));
        return mesh;
    };
    const CutMesh one = tear(1);
    EXPECT_GT(fragmentCount(one), 0u);
    for (int threads : {2, 5}) expectSame(tear(threads), one);
}

TEST_P(CutMeshes, RemovingEverythingLeavesAnEmptyMesh)
{
    CutMesh mesh = cut(6, ballAt(Vec3::Zero(), .5));
    const auto update = mesh.update(raised(mesh, {-8, -8, -8}, {8, 8, 8}, [](Vec3) { return .1; }));
    EXPECT_TRUE(update.topologyChanged);
    EXPECT_TRUE(mesh.elements().empty());
    EXPECT_EQ(mesh.nodeCount(), 0u);
    EXPECT_EQ(mesh.volume(), 0);
    EXPECT_TRUE(tetmesh::extractSurface(mesh).triangles.empty());
}

TEST_P(CutMeshes, SameOrEqualPhiChangesNothing)
{
    CutMesh mesh = cut(6, ballAt(Vec3::Zero(), .5));
    Changes same;
    for (int x = -6; x <= 6; ++x) same.push_back({{x, 0, 0}, mesh.phi()({x, 0, 0})});
    const auto update = mesh.update(same);
    EXPECT_EQ(update.changedVoxels, 0);
    EXPECT_EQ(update.cutCells, 0);
    EXPECT_FALSE(update.topologyChanged);
}

TEST_P(CutMeshes, SplitKeepsMassAtEveryParent)
{
    // The plane of voxel nodes at x = 0 is only just material; then it goes. Every tet there keeps a corner inside on
    // its own side, so inside the ball no volume is lost, only the sharing of nodes.
    const double kThin = 2e-6 * dx;
    constexpr double kRim = 1e-4;  // on the ball's surface, kThin over the distance of a voxel to it: a few 1e-5
    CutMesh mesh = cut(8, ballAt(Vec3(.01, .02, -.03), .7));
    mesh.update(raised(mesh, {0, -10, -10}, {0, 10, 10}, [&](Vec3) { return -kThin; }));
    const CutMesh whole = mesh;
    const std::vector<double> before = lumpedMass(mesh);
    const auto update = mesh.update(raised(mesh, {0, -10, -10}, {0, 10, 10}, [](Vec3) { return 0; }));
    EXPECT_TRUE(update.topologyChanged);
    EXPECT_EQ(fragmentCount(whole), 1u);
    EXPECT_EQ(fragmentCount(mesh), 2u);
    const std::vector<double> after = lumpedMass(mesh);
    std::vector<double> carried(before.size(), 0);
    for (std::size_t i = 0; i < after.size(); ++i) carried[update.previousNode[i]] += after[i];
    const int m = GetParam().coarsening;
    std::size_t deep = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
        bool inside = true;
        for (int z = -m; z <= m; ++z)
            for (int y = -m; y <= m; ++y)
                for (int x = -m; x <= m; ++x)
                    inside = inside && whole.seenPhi(m * whole.nodes()[i] + Coord{x, y, z}) < 0;
        deep += inside;
        EXPECT_LE(carried[i], before[i] * (1 + kSums));
        EXPECT_NEAR(carried[i], before[i], inside ? kSums * before[i] : kRim) << i;
    }
    EXPECT_GT(deep, 0u);
    EXPECT_NEAR(sum(after), mesh.volume() / std::pow(mesh.lattice().spacing(), 3), kSums * sum(after));
}

TEST_P(CutMeshes, MassIsKeptToRoundingWhereOnlyTopologyChanges)
{
    // Nodes of one plane that the cut already sees as 0 but for one bridge; taking the bridge away splits the body in
    // two. Each lattice node keeps its mass over all its copies, less what the cells round the bridge lost.
    CutMesh mesh = cut(8, boxAt(Vec3(.01, .02, -.03), {.6, .55, .5}));
    const auto wall = [&](Coord c) { return c.x == 0 && c != Coord{0, 0, 0}; };
    Changes changes;
    for (int z = -8; z <= 8; ++z)
        for (int y = -8; y <= 8; ++y)
            if (wall({0, y, z}) && mesh.phi()({0, y, z}) < 0) changes.push_back({{0, y, z}, 0});
    mesh.update(changes);
    EXPECT_EQ(fragmentCount(mesh), 1u);
    const auto byLatticeNode = [](const CutMesh& m) {
        const std::vector<double> mass = lumpedMass(m);
        std::map<Coord, double> all;
        for (std::size_t i = 0; i < mass.size(); ++i) all[m.nodes()[i]] += mass[i];
        return all;
    };
    const auto before = byLatticeNode(mesh);
    const std::size_t nodesBefore = mesh.nodeCount();
    const auto update = mesh.update(Changes{{{0, 0, 0}, 0.f}});
    const auto after = byLatticeNode(mesh);
    EXPECT_GT(mesh.nodeCount(), nodesBefore);
    EXPECT_EQ(fragmentCount(mesh), 2u);
    const int m = GetParam().coarsening;
    std::size_t compared = 0;
    for (const auto& [node, mass] : before) {
        const Coord d = m * node;  // farther from the bridge than a cell and a voxel: not one of its tets was cut again
        if (std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)}) <= 2 * m) continue;
        ++compared;
        EXPECT_NEAR(after.at(node), mass, kSums * mass);
    }
    EXPECT_GT(compared, 10u);
}

}  // namespace
