// The Delaunay mesher: what every mesh has to be, that nothing is missed, and what it refuses.
#include "tet_mesh_checks.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/mesher/delaunay.h>
#include <vdbfrac/mesher/sharp_edges.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

using namespace vdbfrac;
using mesher::DelaunayCriteria;
using mesher::ImplicitSolid;

namespace {

constexpr double kPi = std::numbers::pi;

ImplicitSolid solidOf(std::function<double(const Vec3&)> phi, double reach = 1.5)
{
    return {std::move(phi), {Vec3::Constant(-reach), Vec3::Constant(reach)}, {}};
}

double ball(const Vec3& X, const Vec3& center, double r) { return (X - center).norm() - r; }

DelaunayCriteria coarse(double size = .2)
{
    DelaunayCriteria c;
    c.facetSize = size;
    return c;
}

// Triangles whose corners lie on a ball of radius r and whose edges are s cut about s^2 / (8 r) deep; the mesh loses
// no more than that depth of the volume, three times over.
double volumeLost(double size, double r) { return 3 * std::pow(1.75 * size, 2) / (8 * r * r); }

}  // namespace

TEST(DelaunayMesh, BallIsClosedOutwardAndOfItsVolume)
{
    const auto mesh = mesher::delaunayMesh(solidOf([](const Vec3& X) { return ball(X, Vec3::Zero(), 1); }), coarse());
    test::expectSound(mesh);
    EXPECT_EQ(test::componentsOf(mesh), 1u);
    EXPECT_NEAR(volumeOf(mesh), 4 * kPi / 3, 4 * kPi / 3 * volumeLost(.2, 1));
}

TEST(DelaunayMesh, SliverAngleHolds)
{
    const auto mesh =
        mesher::delaunayMesh(solidOf([](const Vec3& X) { return ball(X, Vec3::Zero(), 1); }), coarse(.15));
    constexpr double kAsked = 10;  // degrees; the default sliverAngle is 12, exudation may stop short of it
    EXPECT_GE(test::smallestDihedral(mesh), kAsked);
}

TEST(DelaunayMesh, FindsSmallFarComponentsAndCavities)
{
    // A ball with a cavity off its middle, and a small ball in a corner that no ray from the middle hits by chance.
    const auto phi = [](const Vec3& X) {
        const double hollow = std::max(ball(X, Vec3::Zero(), 1), -ball(X, Vec3(.4, .1, 0), .25));
        return std::min(hollow, ball(X, Vec3(1.25, 1.3, -1.2), .12));
    };
    const auto mesh = mesher::delaunayMesh(solidOf(phi), coarse(.1));
    test::expectSound(mesh);
    EXPECT_EQ(test::componentsOf(mesh), 2u);
    const double volume = 4 * kPi / 3 * (1 - std::pow(.25, 3) + std::pow(.12, 3));
    EXPECT_NEAR(volumeOf(mesh), volume, volume * volumeLost(.1, 1));
    EXPECT_EQ(test::boundaryComponentsOf(mesh), 3u);
}

TEST(DelaunayMesh, SameBitsOnEveryCall)
{
    const auto make = [] {
        return mesher::delaunayMesh(solidOf([](const Vec3& X) { return ball(X, Vec3::Zero(), 1); }), coarse());
    };
    const auto a = make(), b = make();
    EXPECT_EQ(a.points, b.points);
    EXPECT_EQ(a.tets, b.tets);
    EXPECT_EQ(a.boundary, b.boundary);
}

/// CGAL would let the stages against slivers take as long as the refinement took.
TEST(DelaunayMesh, SameBitsHoweverLongPhiTakes)
{
    const auto make = [](std::chrono::nanoseconds wait) {
        mesher::DelaunayCriteria criteria = coarse(.1);
        criteria.sliverAngle = 18;  // more than there is to be had: these stages go on for longer than the refinement
        return mesher::delaunayMesh(solidOf([wait](const Vec3& X) {
                                        const auto until = std::chrono::steady_clock::now() + wait;
                                        while (std::chrono::steady_clock::now() < until) {}
                                        return std::hypot(std::hypot(X.x(), X.y()) - .8, X.z()) - .3;  // a torus
                                    }),
                                    criteria);
    };
    const auto a = make(std::chrono::nanoseconds(0)), b = make(std::chrono::microseconds(2));
    EXPECT_EQ(a.points, b.points);
    EXPECT_EQ(a.tets, b.tets);
}

TEST(DelaunayMesh, SharpEdgesOfACubeAreEdgesOfTheMesh)
{
    const auto cube = [](const Vec3& X) {
        const Vec3 q = X.cwiseAbs() - Vec3::Ones();
        return q.cwiseMax(0.).norm() + std::min(0., q.maxCoeff());
    };
    ImplicitSolid solid = solidOf(cube);
    for (int a = 0; a < 3; ++a)
        for (int s = 0; s < 4; ++s) {
            Vec3 from, to;
            from[a] = -1, to[a] = 1;
            from[(a + 1) % 3] = to[(a + 1) % 3] = s & 1 ? 1 : -1;
            from[(a + 2) % 3] = to[(a + 2) % 3] = s & 2 ? 1 : -1;
            solid.sharpEdges.push_back({from, to});
        }
    const auto mesh = mesher::delaunayMesh(solid, coarse(.25));
    test::expectSound(mesh);
    constexpr double kRounding = 1e-3;  // points of the faces are found by bisection to a 1000th of facetSize
    EXPECT_NEAR(volumeOf(mesh), 8, 8 * kRounding);
    const auto blunt = mesher::delaunayMesh(solidOf(cube), coarse(.25));
    EXPECT_LT(volumeOf(blunt), 8 * (1 - kRounding)) << "without them the test would show nothing";
}

TEST(SharpEdges, OfACubeAreItsTwelve)
{
    tetmesh::PolygonSoup cube;
    for (int c = 0; c < 8; ++c) cube.points.emplace_back(c & 1, c >> 1 & 1, c >> 2 & 1);
    cube.polygons = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    const auto lines = mesher::sharpEdges(cube, 60);
    EXPECT_EQ(lines.size(), 12u);
    for (const auto& line : lines) {
        ASSERT_EQ(line.size(), 2u);
        EXPECT_EQ((line[1] - line[0]).norm(), 1);
    }
    EXPECT_TRUE(mesher::sharpEdges(cube, 100).empty());
}

TEST(SharpEdges, RoundTheCapsOfACylinderAreTwoLoops)
{
    constexpr std::size_t kSides = 24;
    tetmesh::PolygonSoup cylinder;
    cylinder.polygons.resize(2);
    for (std::size_t k = 0; k < kSides; ++k) {
        const double angle = 2 * kPi * double(k) / kSides;
        for (double z : {0., 1.}) cylinder.points.emplace_back(std::cos(angle), std::sin(angle), z);
        const std::size_t a = 2 * k, b = 2 * ((k + 1) % kSides);
        cylinder.polygons.push_back({a, b, b + 1, a + 1});
        cylinder.polygons[0].insert(cylinder.polygons[0].begin(), a);
        cylinder.polygons[1].push_back(a + 1);
    }
    const auto lines = mesher::sharpEdges(cylinder, 60);
    ASSERT_EQ(lines.size(), 2u);
    for (const auto& line : lines) {
        EXPECT_EQ(line.size(), kSides + 1);
        EXPECT_EQ(line.front(), line.back());
    }
}

TEST(DelaunayMesh, SizingFieldRefinesWhereItIsSmall)
{
    DelaunayCriteria c = coarse(.3);
    c.sizing = [](const Vec3& X) { return X.x() > 0 ? .1 : 1; };
    const auto mesh = mesher::delaunayMesh(solidOf([](const Vec3& X) { return ball(X, Vec3::Zero(), 1); }), c);
    test::expectSound(mesh);
    const auto right = std::count_if(mesh.points.begin(), mesh.points.end(), [](const Vec3& X) { return X.x() > .2; });
    const auto left = std::count_if(mesh.points.begin(), mesh.points.end(), [](const Vec3& X) { return X.x() < -.2; });
    EXPECT_GT(right, 4 * left);
}

TEST(DelaunayMesh, RefusesWhatHasNoMesh)
{
    const auto unitBall = [](const Vec3& X) { return ball(X, Vec3::Zero(), 1); };
    EXPECT_THROW(mesher::delaunayMesh(solidOf(unitBall), {}), InputError) << "no size";
    EXPECT_THROW(mesher::delaunayMesh(solidOf(unitBall, .9), coarse()), InputError) << "reaches the box";
    EXPECT_THROW(mesher::delaunayMesh(solidOf([](const Vec3&) { return 1.; }), coarse()), InputError) << "empty";
    EXPECT_THROW(mesher::delaunayMesh(solidOf([](const Vec3& X) { return std::sqrt(X.x()); }), coarse()), InputError)
        << "NaN";
    DelaunayCriteria few = coarse(.05);
    few.maxPoints = 500;
    EXPECT_THROW(mesher::delaunayMesh(solidOf(unitBall), few), LimitError);
}
