// Values of tets and points through cuts of a lattice, and where a point of the material is.
#include "carrying.h"
#include "lattices.h"

#include <vdbfrac/base/disjoint_sets.h>

#include <gtest/gtest.h>

#include <random>

using namespace vdbfrac;
using tetmesh::CutMesh;
using tetmesh::EmbeddedMesh;
using tetmesh::Lattice;

namespace {

class Carrying : public test::Lattices {};
INSTANTIATE_TEST_SUITE_P(All, Carrying, test::kLattices, test::nameOfLattice);

TEST_P(Carrying, ValuesAndPointsFollowTheirTetsThroughSixtyCuts)
{
    CutMesh mesh = cut(10, test::ballAt(Vec3(.01, .02, -.03), .9));
    test::expectCarried(mesh, 10);
}

TEST_P(Carrying, AnUpdateAccountsForEveryElement)
{
    CutMesh mesh = cut(10, test::boxAt(Vec3(.01, .02, -.03), {.9, .5, .4}));
    for (double x : {-.4, 0., .4}) {
        const std::size_t before = mesh.elements().size();
        const auto update = mesh.update(
            test::raised(mesh, {-12, -12, -12}, {12, 12, 12}, [&](Vec3 p) { return .11 - std::abs(p.x() - x); }));
        test::expectComplete(update.previousElement, before, mesh.elements().size());
    }
    const auto none = mesh.update({});
    test::expectComplete(none.previousElement, mesh.elements().size(), mesh.elements().size());
}

/// A slab is taken out of a bar; points on both sides go with their side, wherever the sides go.
TEST_P(Carrying, PointsOnBothSidesOfACrackPart)
{
    constexpr double kRounding = 1e-12;
    CutMesh mesh = cut(10, test::boxAt(Vec3(.01, .02, -.03), {.9, .45, .45}));
    std::mt19937 random(4);
    std::uniform_real_distribution<double> place(-.4, .4);
    std::vector<Vec3> X;
    for (int i = 0; i < 200; ++i) X.push_back({place(random) * 2, place(random), place(random)});
    EmbeddedMesh points(mesh, X);
    ASSERT_EQ(points.lost(), 0u);
    const auto update =
        mesh.update(test::raised(mesh, {-12, -12, -12}, {12, 12, 12}, [](Vec3 p) { return .06 - std::abs(p.x()); }));
    points.carry(mesh, update);
    ASSERT_EQ(test::fragmentCount(mesh), 2u);
    // A node of the right part, as one of its tets shows.
    DisjointSets parts(mesh.nodeCount());
    std::uint32_t right = 0;
    test::eachTet(mesh, [&](std::size_t, std::size_t, const test::Nodes& node) {
        for (std::uint32_t n : node) parts.join(node[0], n);
        if (mesh.restPosition(node[0]).x() > .6) right = node[0];
    });
    std::vector<Vec3> x = tetmesh::restPositions(mesh), at = X;
    for (std::uint32_t n = 0; n < x.size(); ++n)
        if (parts.find(n) == parts.find(right)) x[n] += Vec3(1, 2, 3);
    points.deform(x, at);
    for (std::size_t i = 0; i < X.size(); ++i) {
        if (std::abs(X[i].x()) < .06 || points.isLost(i)) continue;
        EXPECT_LT((at[i] - X[i] - (X[i].x() > 0 ? Vec3(1, 2, 3) : Vec3::Zero())).norm(), kRounding) << X[i];
    }
}

TEST_P(Carrying, APointBesideACrackIsLocatedOnTheSideOfANode)
{
    const CutMesh mesh = cut(10, [](Vec3 p) {
        return std::max((p.cwiseAbs() - Vec3(.83, .43, .43)).maxCoeff(), .06 - std::abs(p.x() - .1));
    });
    ASSERT_EQ(test::fragmentCount(mesh), 2u);
    int twice = 0;
    test::eachTet(mesh, [&](std::size_t, std::size_t, const test::Nodes& node) {
        Vec3 middle = Vec3::Zero();
        for (std::uint32_t n : node) middle += mesh.restPosition(n) / 4;
        for (std::uint32_t n : node) {
            const auto found = mesh.locate(middle, {{n}});
            ASSERT_TRUE(found);
            EXPECT_EQ(std::count(found->point.node.begin(), found->point.node.end(), n), 1);
        }
        const auto any = mesh.locate(middle);
        ASSERT_TRUE(any);
        twice += std::find(any->point.node.begin(), any->point.node.end(), node[0]) == any->point.node.end();
    });
    // Both lips within a cell: then two tets share a place.
    EXPECT_EQ(twice > 0, GetParam().coarsening > 1);
    EXPECT_FALSE(mesh.locate({2, 0, 0}));
}

}  // namespace
