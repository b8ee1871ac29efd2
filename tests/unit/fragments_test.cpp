// What hangs together in a cut mesh: fragments, and the nodes that pieces share.
#include "lattices.h"
#include "surface_checks.h"

#include <vdbfrac/lab/samples/surface_measures.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <vector>

using namespace vdbfrac;
using test::boxAt;
using test::fragmentCount;
using test::fromVoxels;
using test::joined;
using test::Phi;
using test::raised;
using tetmesh::CutMesh;
using tetmesh::Lattice;

namespace {

constexpr double kSums = 1e-12;  // relative: rounding of sums over some thousand pieces

class Fragments : public test::Lattices {};
INSTANTIATE_TEST_SUITE_P(All, Fragments, test::kLattices, test::nameOfLattice);

TEST_P(Fragments, FragmentsAreTheComponentsOfMaterialVoxels)
{
    // Material of two sub-tets hangs together through a face exactly when inside voxels hang together by tet edges.
    std::mt19937 random(77);
    for (double density : {.05, .15, .3, .6}) {
        std::set<Coord> material;
        std::bernoulli_distribution coin(density);
        for (int z = -4; z <= 4; ++z)
            for (int y = -4; y <= 4; ++y)
                for (int x = -4; x <= 4; ++x)
                    if (coin(random)) material.insert({x, y, z});
        std::set<Coord> left = material;
        std::size_t components = 0;
        while (!left.empty()) {
            ++components;
            std::vector<Coord> front{*left.begin()};
            left.erase(left.begin());
            while (!front.empty()) {
                const Coord c = front.back();
                front.pop_back();
                for (auto it = left.begin(); it != left.end();)
                    if (joined(GetParam(), c, *it))
                        front.push_back(*it), it = left.erase(it);
                    else
                        ++it;
            }
        }
        const CutMesh mesh = fromVoxels(GetParam(), 5, material);
        EXPECT_EQ(fragmentCount(mesh), components) << density;
        test::expectClosed(mesh);
    }
}

TEST(CutMeshNodes, PiecesOfOneCellThatDoNotTouchHaveTheirOwnCopies)
{
    // Coarse cell of 3 voxels an edge; two opposite inner edges of it hold material that nothing joins.
    const Lattice lattice{Lattice::Kind::six, 3, 0.1};
    const CutMesh mesh = fromVoxels(lattice, 4, {{1, 0, 0}, {1, 3, 3}});
    EXPECT_EQ(fragmentCount(mesh), 2u);
    // With m = 1, the two ends of a cell's diagonal that is no tet edge.
    const Lattice fine{Lattice::Kind::six, 1, 0.1};
    EXPECT_EQ(fragmentCount(fromVoxels(fine, 4, {{1, 0, 0}, {0, 1, 0}})), 2u);
    EXPECT_EQ(fragmentCount(fromVoxels(fine, 4, {{0, 0, 0}, {1, 1, 0}})), 1u);
    // Elements of the cell that holds both share no node.
    const CutMesh two = fromVoxels(fine, 4, {{1, 0, 0}, {0, 1, 0}});
    const auto& cell = two.cells()[std::size_t(two.cellAt({0, 0, 0}))];
    ASSERT_EQ(cell.elements, 2u);
    std::set<std::uint32_t> first(two.elements()[cell.firstElement].node.begin(),
                                  two.elements()[cell.firstElement].node.end());
    for (std::uint32_t n : two.elements()[cell.firstElement + 1].node) EXPECT_FALSE(first.contains(n));
}

TEST(CutMeshNodes, MaterialJoinedOnlyRoundTheDiagonalStaysOne)
{
    // Corners 1, 3, 2, 6, 4, 5 make a ring round the cell's diagonal, each next to the following by a tet edge; the
    // diagonal's ends 0 and 7 are no material. Without corner 2, corners 3 and 6 lose each other there.
    const Lattice fine{Lattice::Kind::six, 1, 0.1};
    const auto corner = [](int c) { return Coord{c & 1, c >> 1 & 1, c >> 2 & 1}; };
    std::set<Coord> ring;
    for (int c : {1, 3, 2, 6, 4, 5}) ring.insert(corner(c));
    const CutMesh whole = fromVoxels(fine, 4, ring);
    EXPECT_EQ(fragmentCount(whole), 1u);
    EXPECT_EQ(whole.cells()[std::size_t(whole.cellAt({0, 0, 0}))].elements, 1u);
    ring.erase(corner(2));
    EXPECT_EQ(fragmentCount(fromVoxels(fine, 4, ring)), 1u);  // the other way round is open
    ring.erase(corner(5));
    EXPECT_EQ(fragmentCount(fromVoxels(fine, 4, ring)), 2u);
}

TEST_P(Fragments, SheetOneCellThickIsOneClosedBody)
{
    const CutMesh mesh = cut(10, [&](Vec3 p) {
        return std::max(std::abs(p.z() - .02) - .5 * GetParam().spacing(),
                        std::max(std::abs(p.x()), std::abs(p.y())) - .7);
    });
    EXPECT_EQ(fragmentCount(mesh), 1u);
    test::expectClosed(mesh);
    EXPECT_NEAR(lab::enclosedVolume(mesh), mesh.volume(), kSums * mesh.volume());
    // 1.4 x 1.4 x h, less what linear interpolation cuts off: the ridge of phi between two nodes (a third of a voxel of
    // thickness), and the rim.
    EXPECT_LT(mesh.volume(), 1.4 * 1.4 * GetParam().spacing());
    EXPECT_GT(mesh.volume(), 1.4 * 1.4 * (GetParam().spacing() - dx / 3));
}

TEST_P(Fragments, FragmentsKeepTheirHistory)
{
    std::uint32_t nextId = 5;  // another body has taken 0 to 4
    CutMesh mesh = cut(10, boxAt(Vec3(.01, .02, -.03), {.85, .4, .4}));
    tetmesh::FragmentTracker tracker(mesh, nextId);
    ASSERT_EQ(tracker.fragments().size(), 1u);
    EXPECT_EQ(tracker.fragments()[0].id, 5u);
    EXPECT_EQ(tracker.fragments()[0].parent, -1);
    const auto slab = [&](int lower, int upper, double time) {
        const auto update = mesh.update(raised(mesh, {lower, -12, -12}, {upper, 12, 12}, [](Vec3) { return .05; }));
        tracker.update(mesh, update.previousNode, time, nextId);
        EXPECT_EQ(tracker.ofNode().size(), mesh.nodeCount());
        double volume = 0;
        for (const auto& f : tracker.fragments()) volume += f.restVolume;
        EXPECT_NEAR(volume, mesh.volume(), kSums * mesh.volume());
    };
    slab(3, 4, 1.5);  // the part at x < .3 is the larger one
    ASSERT_EQ(tracker.fragments().size(), 2u);
    EXPECT_EQ(tracker.fragments()[1].id, 6u);
    EXPECT_EQ(tracker.fragments()[1].parent, 5);
    EXPECT_EQ(tracker.fragments()[1].birth, 1.5);
    EXPECT_GT(tracker.fragments()[0].restVolume, tracker.fragments()[1].restVolume);
    for (std::size_t i = 0; i < mesh.nodeCount(); ++i) {
        if (mesh.restPosition(i).x() < -.1) {
            EXPECT_EQ(tracker.ofNode()[i], 5u);
        } else if (mesh.restPosition(i).x() > .8) {
            EXPECT_EQ(tracker.ofNode()[i], 6u);
        }
    }
    slab(5, 12, 2);  // fragment 6 goes altogether
    EXPECT_EQ(tracker.alive(), 1u);
    EXPECT_EQ(tracker.fragments()[1].restVolume, 0);
    slab(-3, -2, 3);  // a new one: its id is new, too
    ASSERT_EQ(tracker.fragments().size(), 3u);
    EXPECT_EQ(tracker.fragments()[2].id, 7u);
    EXPECT_EQ(tracker.fragments()[2].parent, 5);
    EXPECT_EQ(nextId, 8u);
}

}  // namespace
