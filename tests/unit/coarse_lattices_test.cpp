// Cells of many voxels.
#include "mesh_checks.h"
#include "surface_checks.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/lab/samples/block.h>
#include <vdbfrac/lab/samples/surface_measures.h>

#include <gtest/gtest.h>

#include <string>

using namespace vdbfrac;
using test::ballAt;
using test::boxAt;
using test::fragmentCount;
using test::Phi;
using tetmesh::CutMesh;
using tetmesh::Lattice;

namespace {

constexpr double kSums = 1e-12;  // relative: rounding of sums over some thousand pieces

/// Nothing depends on the spacing of the lattice but what shares a node: pieces are those of the voxels. At 19 and 18
/// voxels to a cell indices into stencils are as large as they get.
TEST(CoarseLattices, VolumeAndSurfaceAreThoseOfTheVoxelsUpToTheCoarsestLattice)
{
    constexpr double dx = 0.02;
    constexpr int kReach = 25;
    const Vec3 off(.003, -.0042, .0074);  // no symmetry with the grid
    for (const Phi& phi : {boxAt(off, {.45, .41, .38}), ballAt(off, .44)}) {
        const auto cut = [&](int coarsening) {
            const Coord corner{kReach, kReach, kReach};
            return CutMesh({Lattice::Kind::six, coarsening, dx},
                           lab::sample({-kReach, -kReach, -kReach}, corner, dx, phi));
        };
        const CutMesh fine = cut(1);
        const double area = tetmesh::extractSurface(fine).cutArea;
        for (const int coarsening : {tetmesh::kMaxCoarsening - 1, tetmesh::kMaxCoarsening}) {
            const CutMesh mesh = cut(coarsening);
            EXPECT_NEAR(mesh.volume(), fine.volume(), kSums * fine.volume()) << coarsening;
            EXPECT_NEAR(tetmesh::extractSurface(mesh).cutArea, area, kSums * area) << coarsening;
            test::expectClosed(mesh);
            EXPECT_NEAR(lab::enclosedVolume(mesh), mesh.volume(), kSums * mesh.volume()) << coarsening;
            EXPECT_EQ(fragmentCount(mesh), 1u) << coarsening;
        }
    }
}

TEST(CoarseLattices, CoarserThanIndicesCanTellIsRefused)
{
    const auto phi = lab::sample({-3, -3, -3}, {3, 3, 3}, 0.1, ballAt(Vec3::Zero(), .25));
    for (const int coarsening : {tetmesh::kMaxCoarsening + 1, 22, 40, 1024, 0, -1}) {
        try {
            const CutMesh mesh({Lattice::Kind::six, coarsening, 0.1}, phi);
            ADD_FAILURE() << coarsening << " was taken";
        } catch (const Error& e) {
            EXPECT_NE(std::string(e.what()).find("1 to " + std::to_string(tetmesh::kMaxCoarsening)), std::string::npos)
                << e.what();
        }
    }
    EXPECT_THROW(CutMesh({Lattice::Kind::five, 2, 0.1}, phi), Error);  // five tets do not nest
}

}  // namespace
