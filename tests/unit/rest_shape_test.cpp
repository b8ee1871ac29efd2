// Bodies have the volume, mass and moments of their true shape at rest, and material that goes takes its own along.
#include "lattices.h"
#include "surface_checks.h"
#include "tets_of_box.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/cut_tet_mesh.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

using namespace vdbfrac;
using test::ballAt;
using test::boxAt;
using test::expectSame;
using test::fragmentCount;
using test::hollow;
using test::Phi;
using test::raised;
using tetmesh::CutMesh;
using tetmesh::Lattice;

namespace {

/// A solid with its center at the origin, its volume, and integral of x_i^2 over it.
struct Solid {
    const char* name;
    Phi phi;
    double volume;
    Vec3 second;
};

Phi cylinder(double radius, double half)
{
    return [=](Vec3 p) {
        const double side = p.head<2>().norm() - radius, end = std::abs(p.z()) - half;
        return std::max(side, end);
    };
}

/// Of n voxels across; the plate has half of them along its shortest side.
std::vector<Solid> solids()
{
    const auto box = [](const char* name, Vec3 size) {
        return Solid{name, boxAt(Vec3::Zero(), size / 2), size.prod(), size.prod() / 12 * size.cwiseProduct(size)};
    };
    const double pi = std::numbers::pi, ball = pi / 6, rod = pi / 4;
    return {box("cube", {1, 1, 1}),
            box("plate", {2, 1.5, .5}),
            {"sphere", ballAt(Vec3::Zero(), .5), ball, Vec3::Constant(ball / 20)},
            {"cylinder", cylinder(.5, .5), rod, {rod / 16, rod / 16, rod / 12}}};
}

tetmesh::RestShape shapeOf(const Phi& phi)
{
    return [phi](std::span<const Vec3> X, std::span<double> values) {
        std::transform(X.begin(), X.end(), values.begin(), phi);
    };
}

Phi movedBy(const Vec3& offset, const Phi& phi)
{
    return [=](Vec3 p) { return phi(p - offset); };
}

CutMesh trueCut(Lattice lattice, const Phi& phi, double reach)
{
    const int r = int(reach / lattice.voxelSize) + 3;
    return {lattice, lab::sample({-r, -r, -r}, {r, r, r}, lattice.voxelSize, phi), shapeOf(phi)};
}

test::Changes valuesOf(const tetmesh::BodyMesh& mesh)
{
    test::Changes all;
    mesh.phi().forEachBlock([&](Coord low) {
        mesh.phi().forEachNode(low, [&](Coord c) { all.push_back({c, mesh.phi()(c)}); });
    });
    return all;
}

tetmesh::CutTetMesh trueTets(int m, double dx, const Phi& phi, double reach, double shake = .2)
{
    const int r = m * (int(reach / dx / m) + 3);
    return {test::tetsOfBox(r, m, shake, dx), m * dx, dx, lab::sample({-r, -r, -r}, {r, r, r}, dx, phi), shapeOf(phi)};
}

struct Errors {
    double volume = 0, center = 0, second = 0;  ///< relative; of the solid's size; relative
};

Errors errorsOf(const CutMesh& mesh, const Solid& solid, const Vec3& offset)
{
    const std::vector<double> mass = test::lumpedMass(mesh);
    const double cell = std::pow(mesh.spacing(), 3);
    Vec3 first = Vec3::Zero(), second = Vec3::Zero();
    for (std::size_t i = 0; i < mass.size(); ++i) {
        const Vec3 X = mesh.restPosition(i) - offset;
        first += cell * mass[i] * X, second += cell * mass[i] * X.cwiseProduct(X);
    }
    return {std::abs(mesh.volume() / solid.volume - 1), (first / solid.volume).norm(),
            (second.cwiseQuotient(solid.second) - Vec3::Ones()).cwiseAbs().maxCoeff()};
}

class RestShapes : public test::Lattices {};
INSTANTIATE_TEST_SUITE_P(All, RestShapes, test::kLattices, test::nameOfLattice);

/// Order over two halvings of the voxels.
double order(double coarse, double fine) { return std::log2(coarse / fine) / 2; }

TEST_P(RestShapes, VolumeAndMomentsAreThoseOfTheSolidAtSecondOrder)
{
    constexpr double kAtEight = 5e-3, kOrder = 1.8, kExact = 5e-4;
    for (const Solid& solid : solids())
        for (const Vec3& shift : {Vec3(0, 0, 0), Vec3(.5, .5, .5), Vec3(.13, -.21, .37), Vec3(.9, .85, .8)}) {
            std::array<Errors, 3> error;  // at 4, 8, 16 voxels across
            for (std::size_t k = 0; k < 3; ++k) {
                Lattice lattice = GetParam();
                lattice.voxelSize = 1. / (4 << k);
                const Vec3 offset = lattice.voxelSize * shift;
                error[k] = errorsOf(trueCut(lattice, movedBy(offset, solid.phi), 1.1), solid, offset);
            }
            SCOPED_TRACE(std::string(solid.name) + " moved by " + std::to_string(shift.x()) + " voxels");
            EXPECT_LT(error[1].volume, kAtEight);
            EXPECT_TRUE(error[2].volume < kExact || order(error[0].volume, error[2].volume) > kOrder);
            EXPECT_TRUE(error[2].center < kExact || order(error[0].center, error[2].center) > kOrder);
            // A tet gives each of its corners a quarter of its mass: that has second order too, and is most of it.
            // With three voxels to a cell the coarsest have a cell or two.
            EXPECT_GT(std::log2(error[1].second / error[2].second), kOrder);
        }
}

TEST_P(RestShapes, CubesAndPlatesOnVoxelPlanesAreExact)
{
    constexpr double kRounding = 1e-6;  // factors are floats
    for (int cells : {4, 8}) {
        Lattice lattice = GetParam();
        lattice.voxelSize = 1. / cells;
        for (const Vec3& size : {Vec3(1, 1, 1), Vec3(2, 1.5, .5)})
            EXPECT_NEAR(trueCut(lattice, boxAt(Vec3::Zero(), size / 2), 1.1).volume(), size.prod(),
                        kRounding * size.prod());
    }
}

/// Masses of lattice nodes, each once.
std::map<Coord, double> massesOf(const CutMesh& mesh)
{
    const std::vector<double> mass = test::lumpedMass(mesh);
    std::map<Coord, double> sum;
    for (std::size_t i = 0; i < mass.size(); ++i) sum[mesh.nodes()[i]] += mass[i];
    return sum;
}

TEST(MirroredSolids, HaveMirroredMasses)
{
    constexpr double kRounding = 1e-12;  // of a cell
    using Kind = Lattice::Kind;
    for (const Solid& solid : solids())
        for (const auto& [kind, m] : {std::pair(Kind::six, 1), {Kind::six, 2}, {Kind::five, 1}})
            for (double across : {4., 6., 7., 7.3, 8.}) {
                const auto mass = massesOf(trueCut({kind, m, 1 / across}, solid.phi, 1.1));
                SCOPED_TRACE(std::string(solid.name) + " of " + std::to_string(across) + " voxels");
                for (const auto& [node, own] : mass) {
                    ASSERT_NEAR(own, mass.at(-1 * node), kRounding);
                    // Six tets are their own image when x and y are swapped, and so are all solids but the plate.
                    if (kind == Kind::five) {
                        ASSERT_NEAR(own, mass.at({-node.x, node.y, node.z}), kRounding);
                    } else if (solid.name != std::string("plate")) {
                        ASSERT_NEAR(own, mass.at({node.y, node.x, node.z}), kRounding);
                    }
                }
            }
}

TEST_P(RestShapes, IntegralsOfVoxelsAddUpToTheVolume)
{
    constexpr double kRounding = 1e-9;
    for (const Phi& phi : {boxAt(Vec3::Zero(), {.6, .5, .4}), ballAt(Vec3(.01, .02, -.03), .7)}) {
        const CutMesh mesh = trueCut(GetParam(), phi, .7);
        double sum = 0;
        for (int z = -10; z <= 10; ++z)
            for (int y = -10; y <= 10; ++y)
                for (int x = -10; x <= 10; ++x)
                    sum += mesh.nodalShare({x, y, z}, [](std::uint32_t, int) { return 0.; }).volume;
        EXPECT_NEAR(sum * dx * dx * dx, mesh.volume(), kRounding);
        EXPECT_EQ(sum, [&] {
            double again = 0;
            for (int z = -10; z <= 10; ++z)
                for (int y = -10; y <= 10; ++y)
                    for (int x = -10; x <= 10; ++x)
                        again += mesh.nodalShare({x, y, z}, [](std::uint32_t, int) { return 1.; }).energy;
            return again;
        }());
    }
}

TEST_P(RestShapes, SurfaceIsThatOfTheLinearCut)
{
    for (const Phi& phi : {boxAt(Vec3::Zero(), {.6, .5, .4}), ballAt(Vec3(.01, .02, -.03), .7)}) {
        const CutMesh mesh = trueCut(GetParam(), phi, .7), linear = cut(10, phi);
        test::expectClosed(mesh);
        EXPECT_EQ(mesh.surface().triangles.size(), linear.surface().triangles.size());
        EXPECT_NEAR(mesh.surface().cutArea, linear.surface().cutArea, 1e-12);
    }
}

TEST_P(RestShapes, SlitOfOneVoxelStaysEmptyAndParts)
{
    constexpr double kRounding = 1e-6;
    const Phi box = boxAt(Vec3::Zero(), {.6, .6, .6}), slit = boxAt({.05, 0, 0}, {.05, 2, 2});
    const CutMesh mesh = trueCut(
        GetParam(), [&](Vec3 p) { return std::max(box(p), -slit(p)); }, .7);
    EXPECT_NEAR(mesh.volume(), 1.2 * 1.2 * 1.1, kRounding);
    EXPECT_EQ(fragmentCount(mesh), 2u);
}

TEST_P(RestShapes, NarrowSlitWithNodesInItParts)
{
    const Phi box = boxAt(Vec3::Zero(), {.6, .125, .7}), slit = boxAt({0, 0, 0}, {.03, 2, 2});
    const CutMesh mesh = trueCut(
        GetParam(), [&](Vec3 p) { return std::max(box(p), -slit(p)); }, .8);
    EXPECT_EQ(fragmentCount(mesh), 2u);
    EXPECT_EQ(fragmentCount(trueTets(
                  1, dx, [&](Vec3 p) { return std::max(box(p), -slit(p)); }, .8, 0)),
              2u);
}

TEST_P(RestShapes, BoxesThatTouchAlongAnEdgeAreTwo)
{
    const Phi one = boxAt({.3, .3, 0}, {.3, .3, .5}), two = boxAt({-.3, -.3, 0}, {.3, .3, .5});
    const CutMesh mesh = trueCut(
        GetParam(), [&](Vec3 p) { return std::min(one(p), two(p)); }, .7);
    EXPECT_EQ(fragmentCount(mesh), 2u);
}

TEST(Edges, DoNotBridgeACrackOfOneRowOfVoxels)
{
    using Kind = Lattice::Kind;
    constexpr double dx = .1;
    for (const Lattice& lattice : {Lattice{Kind::six, 1, dx}, Lattice{Kind::six, 2, dx}, Lattice{Kind::five, 1, dx}})
        for (const Vec3& half : {Vec3(1, .3, .3), Vec3(1, .29, .26), Vec3(1, .32, .37)})
            for (int row : {-3, 0, 2}) {
                CutMesh mesh = trueCut(lattice, boxAt(Vec3::Zero(), half), 1);
                EXPECT_EQ(fragmentCount(mesh), 1u);
                const double before = mesh.volume();
                mesh.update(raised(mesh, {row, -9, -9}, {row, 9, 9}, [](Vec3) { return .01; }));
                EXPECT_EQ(fragmentCount(mesh), 2u) << row << " " << half.transpose();
                // What is attached goes with its voxel: no more than two layers of voxels.
                EXPECT_GT(mesh.volume(), before - 2 * dx * 4 * half.y() * half.z());
            }
}

TEST_P(RestShapes, MaterialNeverGrowsAndUpdatesDoNotDependOnTheirOrder)
{
    std::mt19937 random(19);
    std::uniform_real_distribution<double> place(-.8, .8), size(.05, .35);
    for (const Phi& solid : {boxAt(Vec3::Zero(), {.6, .5, .7}), ballAt(Vec3(.01, .02, -.03), .7),
                             boxAt(Vec3(.013, .044, .031), {.6, .5, .7})}) {
        CutMesh mesh = trueCut(GetParam(), solid, .8);
        for (int round = 0; round < 25; ++round) {
            const double x = place(random), y = place(random), z = place(random);
            const CutMesh before = mesh;
            const auto update =
                mesh.update(raised(mesh, {-12, -12, -12}, {12, 12, 12}, hollow(ballAt({x, y, z}, size(random)))));
            ASSERT_LE(mesh.volume(), before.volume());
            for (const auto& r : update.previousElement.recut)
                for (std::size_t t = 0; t < tetmesh::kMaxTets; ++t)
                    if (const double now = mesh.elements()[r.element].fraction[t]; now > 0) {
                        ASSERT_LE(now, before.elements()[r.old[t]].fraction[t] + 1e-12);
                    }
            for (std::size_t i = 0; i < mesh.nodeCount(); ++i)
                ASSERT_EQ(before.nodes()[update.previousNode[i]], mesh.nodes()[i]);
            if (round % 5 > 0) continue;
            test::expectClosed(mesh);
            CutMesh atOnce = trueCut(GetParam(), solid, .8);  // as a run that goes on makes it
            atOnce.update(valuesOf(mesh));
            expectSame(mesh, atOnce);
            if (HasFatalFailure()) return;
        }
        mesh.update(raised(mesh, {-12, -12, -12}, {12, 12, 12}, [](Vec3) { return .1; }));
        EXPECT_EQ(mesh.volume(), 0);
        EXPECT_EQ(mesh.nodeCount(), 0u);
    }
}

TEST_P(RestShapes, SameBitsForAnyNumberOfThreads)
{
    const auto make = [&](int threads) {
        const ThreadLimit limit(threads);
        return trueCut(GetParam(), boxAt(Vec3(.013, .044, .031), {.6, .5, .7}), .8);
    };
    const CutMesh one = make(1);
    for (int threads : {2, 5}) expectSame(make(threads), one);
}

TEST(RestShapesOfTets, VolumeIsThatOfTheSolidAtSecondOrder)
{
    constexpr double kAtEightCells = 5e-3, kOrder = 1.8;
    for (std::size_t m : {1u, 2u})
        for (const Solid& solid : solids())
            for (const Vec3& shift : {Vec3(0, 0, 0), Vec3(.9, .85, .8)}) {
                std::array<double, 3> error;  // at 4, 8, 16 voxels across
                for (std::size_t k = 0; k < 3; ++k) {
                    const double dx = 1. / (4 << k);
                    const auto mesh = trueTets(int(m), dx, movedBy(dx * shift, solid.phi), 1.1);
                    error[k] = std::abs(mesh.volume() / solid.volume - 1);
                }
                SCOPED_TRACE(std::string(solid.name) + " moved by " + std::to_string(shift.x()) + " voxels");
                EXPECT_LT(error[m], kAtEightCells);
                EXPECT_GT(order(error[0], error[2]), kOrder);
            }
}

TEST(RestShapesOfTets, MaterialNeverGrowsAndUpdatesDoNotDependOnTheirOrder)
{
    constexpr double dx = .1;
    std::mt19937 random(23);
    std::uniform_real_distribution<double> place(-.6, .6), size(.05, .35);
    const Phi solid = boxAt(Vec3(.013, .044, .031), {.6, .5, .4});
    tetmesh::CutTetMesh mesh = trueTets(1, dx, solid, .7);
    EXPECT_EQ(fragmentCount(mesh), 1u);
    for (int round = 0; round < 12; ++round) {
        const double x = place(random), y = place(random), z = place(random), before = mesh.volume();
        const std::vector<tetmesh::CellElement> old = mesh.elements();
        const auto update = mesh.update(raised(mesh, {-9, -9, -9}, {9, 9, 9}, hollow(ballAt({x, y, z}, size(random)))));
        ASSERT_LE(mesh.volume(), before);
        for (const auto& r : update.previousElement.recut)
            ASSERT_LE(mesh.elements()[r.element].fraction[0], old[r.old[0]].fraction[0] + 1e-12);
        test::expectClosed(mesh);
    }
    tetmesh::CutTetMesh atOnce = trueTets(1, dx, solid, .7);
    atOnce.update(valuesOf(mesh));
    ASSERT_EQ(mesh.elements().size(), atOnce.elements().size());
    for (std::size_t e = 0; e < mesh.elements().size(); ++e) {
        ASSERT_EQ(mesh.elements()[e].node, atOnce.elements()[e].node);
        ASSERT_EQ(mesh.elements()[e].fraction, atOnce.elements()[e].fraction);
    }
}

TEST(RestShapesOfTets, ACrackPartsABar)
{
    for (double shake : {0., .2}) {
        tetmesh::CutTetMesh mesh = trueTets(1, .1, boxAt(Vec3::Zero(), {.8, .29, .32}), .9, shake);
        EXPECT_EQ(fragmentCount(mesh), 1u);
        mesh.update(raised(mesh, {0, -9, -9}, {1, 9, 9}, [](Vec3) { return .1; }));
        EXPECT_EQ(fragmentCount(mesh), 2u);
    }
}

}  // namespace
