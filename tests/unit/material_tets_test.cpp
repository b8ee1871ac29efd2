// Cut meshes as tets with shared points: conforming, closed, of the material's volume; and how good tets are.
#include "mesh_checks.h"
#include "surface_checks.h"
#include "tet_mesh_checks.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/lab/samples/block.h>
#include <vdbfrac/tetmesh/material_tets.h>
#include <vdbfrac/tetmesh/tet_quality.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

using namespace vdbfrac;
using tetmesh::CutMesh;
using tetmesh::Lattice;
using tetmesh::TetMesh;

namespace {

constexpr double kRounding = 1e-12;

class MaterialTets : public testing::TestWithParam<Lattice> {
protected:
    CutMesh cut(const test::Phi& phi, int reach) const
    {
        return {GetParam(), lab::sample({-reach, -reach, -reach}, {reach, reach, reach}, GetParam().voxelSize, phi)};
    }
};

std::array<std::uint32_t, 3> sortedFace(std::array<std::uint32_t, 3> f)
{
    std::sort(f.begin(), f.end());
    return f;
}

/// Sides that two tets share are the same triangle to both: no face lies within a larger one. In a closed mesh of the
/// right volume that leaves room only for faces that three tets have.
void expectNoCrowdedFaces(const TetMesh& mesh)
{
    std::map<std::array<std::uint32_t, 3>, int> count;
    for (const auto& t : mesh.tets)
        for (const auto& f : tetmesh::kTetFaces) ++count[sortedFace({t[f[0]], t[f[1]], t[f[2]]})];
    for (const auto& [face, n] : count) ASSERT_LE(n, 2);
}

TEST_P(MaterialTets, OfABallAreSoundAndOfItsVolume)
{
    const double dx = GetParam().voxelSize;
    const CutMesh mesh = cut(test::ballAt(dx * Vec3(.13, -.21, .34), 7.3 * dx), 9);
    const TetMesh tets = tetmesh::materialTets(mesh);
    test::expectSound(tets);
    expectNoCrowdedFaces(tets);
    EXPECT_NEAR(volumeOf(tets), mesh.volume(), kRounding * mesh.volume());
    EXPECT_EQ(test::componentsOf(tets), 1u);
}

TEST_P(MaterialTets, OfRandomPhiAreSoundAndOfItsVolume)
{
    const double dx = GetParam().voxelSize;
    std::mt19937 random(3);
    std::uniform_real_distribution<double> value(-dx, dx);
    const CutMesh mesh = cut([&](Vec3 p) { return p.cwiseAbs().maxCoeff() < 6.5 * dx ? value(random) : dx; }, 8);
    const TetMesh tets = tetmesh::materialTets(mesh);
    test::expectSound(tets);
    expectNoCrowdedFaces(tets);
    EXPECT_NEAR(volumeOf(tets), mesh.volume(), kRounding * mesh.volume());
}

TEST_P(MaterialTets, AreSoundWherePhiIsZeroOnNodesEdgesAndFaces)
{
    const double dx = GetParam().voxelSize;
    std::mt19937 random(4);
    std::uniform_int_distribution<int> value(-1, 1);  // a third of all nodes has phi = 0
    for (const test::Phi& phi : {test::boxAt(Vec3::Zero(), 5 * dx * Vec3::Ones()), test::Phi([&](Vec3 p) {
                                     return p.cwiseAbs().maxCoeff() < 6.5 * dx ? value(random) * dx : dx;
                                 })}) {
        const CutMesh mesh = cut(phi, 8);
        const TetMesh tets = tetmesh::materialTets(mesh);
        test::expectSound(tets);
        // A crossing kSnap dx off its node, on up to every one of the cells' ~ 1 dx^2 of surface a dx^3.
        EXPECT_NEAR(volumeOf(tets), mesh.volume(), 10 * tetmesh::kSnap * mesh.volume());
    }
}

TEST_P(MaterialTets, BoundaryIsTheSurface)
{
    const double dx = GetParam().voxelSize;
    const CutMesh mesh = cut(test::torus(5.2 * dx, 2.4 * dx), 9);
    const TetMesh tets = tetmesh::materialTets(mesh);
    const auto surface = tetmesh::extractSurface(mesh);
    EXPECT_EQ(tets.boundary.size(), surface.triangles.size());
    double area = 0;
    for (const auto& f : tets.boundary)
        area += .5 * (tets.points[f[1]] - tets.points[f[0]]).cross(tets.points[f[2]] - tets.points[f[0]]).norm();
    EXPECT_NEAR(area, surface.cutArea, kRounding * area);
}

TEST_P(MaterialTets, WholeTetsAreThoseOfTheMeshAndWeighItsVolume)
{
    const double dx = GetParam().voxelSize;
    const CutMesh mesh = cut(test::ballAt(dx * Vec3(.13, -.21, .34), 7.3 * dx), 9);
    const auto whole = tetmesh::wholeTets(mesh);
    test::expectSound(whole.mesh);
    EXPECT_EQ(whole.mesh.points.size(), mesh.nodeCount());
    ASSERT_EQ(whole.fraction.size(), whole.mesh.tets.size());
    double weighed = 0;
    for (std::size_t t = 0; t < whole.fraction.size(); ++t) {
        ASSERT_GT(whole.fraction[t], 0);
        weighed += whole.fraction[t] * tetVolume(whole.mesh, t);
    }
    EXPECT_NEAR(weighed, mesh.volume(), kRounding * mesh.volume());
    EXPECT_GT(volumeOf(whole.mesh), mesh.volume());
}

TEST_P(MaterialTets, HaveTheSameBitsForAnyNumberOfThreads)
{
    const double dx = GetParam().voxelSize;
    const auto make = [&](int threads) {
        const ThreadLimit limit(threads);
        return tetmesh::materialTets(cut(test::ballAt(Vec3::Zero(), 8.3 * dx), 10));
    };
    const TetMesh one = make(1), three = make(3);
    EXPECT_EQ(one.points, three.points);
    EXPECT_EQ(one.tets, three.tets);
    EXPECT_EQ(one.boundary, three.boundary);
}

INSTANTIATE_TEST_SUITE_P(, MaterialTets,
                         testing::Values(Lattice{Lattice::Kind::six, 1, .1}, Lattice{Lattice::Kind::six, 2, .1},
                                         Lattice{Lattice::Kind::five, 1, .1}),
                         [](const auto& info) {
                             return (info.param.kind == Lattice::Kind::six ? "six" : "five") +
                                    std::to_string(info.param.coarsening);
                         });

TEST(TetQuality, KnowsRegularAndCornerTets)
{
    constexpr double kSmall = 1e-12;
    TetMesh regular;
    regular.points = {{0, 0, 0}, {1, 1, 0}, {0, 1, 1}, {1, 0, 1}};
    regular.tets = {{0, 1, 2, 3}};
    auto q = qualityOf(regular);
    const double dihedral = std::acos(1. / 3) * 180 / std::numbers::pi;
    EXPECT_NEAR(q.smallestDihedral, dihedral, 1e-10);
    EXPECT_NEAR(q.largestDihedral, dihedral, 1e-10);
    EXPECT_NEAR(q.smallestRadiusRatio, 1, kSmall);
    EXPECT_NEAR(q.volume, 1. / 3, kSmall);
    EXPECT_EQ(q.dihedrals[7], 6);

    TetMesh corner;  // r = 1 / (3 + sqrt 3), R = sqrt 3 / 2
    corner.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    corner.tets = {{0, 1, 2, 3}};
    q = qualityOf(corner);
    EXPECT_NEAR(q.meanRadiusRatio, 3 / (3 + std::sqrt(3.)) * 2 / std::sqrt(3.), kSmall);
    EXPECT_NEAR(q.largestDihedral, 90, 1e-10);
    EXPECT_EQ(q.inverted, 0);
    corner.tets = {{1, 0, 2, 3}};
    EXPECT_EQ(qualityOf(corner).inverted, 1);
}

TEST(TetMeshParts, LowestFirstKeepsTheOrientation)
{
    TetMesh mesh;
    mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    std::array<std::uint32_t, 4> tet{0, 1, 2, 3};
    do {
        mesh.tets = {tet};
        const double before = tetVolume(mesh, 0);
        mesh.tets = {tetmesh::lowestFirst(tet)};
        EXPECT_EQ(mesh.tets[0][0], 0u);
        EXPECT_GT(before * tetVolume(mesh, 0), 0);
    } while (std::next_permutation(tet.begin(), tet.end()));
}

}  // namespace
