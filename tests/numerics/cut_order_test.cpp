// The cut converges to the sphere it stands for, in volume and in area, at second order.
#include "surface_checks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

using namespace vdbfrac;
using tetmesh::Lattice;

namespace {

struct Errors {
    double volume = 0, area = 0;  ///< relative
};

/// Mean of |error| over several places of the center between the voxels.
Errors errorsAt(const Lattice::Kind kind, int coarsening, int cellsPerRadius)
{
    constexpr int kPlaces = 4;
    const double R = 1, dx = R / cellsPerRadius, pi = std::numbers::pi;
    const int reach = cellsPerRadius + 2;
    std::mt19937 random(8);
    std::uniform_real_distribution<double> place(-.5, .5);
    Errors mean;
    for (int k = 0; k < kPlaces; ++k) {
        const double x = place(random), y = place(random), z = place(random);
        const Vec3 center = dx * Vec3(x, y, z);
        const tetmesh::CutMesh mesh(Lattice{kind, coarsening, dx},
                                    lab::sample({-reach, -reach, -reach}, {reach, reach, reach}, dx,
                                                [&](Vec3 p) { return (p - center).norm() - R; }));
        mean.volume += std::abs(mesh.volume() / (4. / 3 * pi) - 1) / kPlaces;
        mean.area += std::abs(mesh.surface().cutArea / (4 * pi) - 1) / kPlaces;
    }
    return mean;
}

struct Case {
    Lattice::Kind kind;
    int coarsening;
};

class CutCells : public testing::TestWithParam<Case> {};

TEST_P(CutCells, SphereVolumeAndAreaConvergeSecondOrder)
{
    constexpr double kOrder = 1.8;  // linear interpolation has 2; places of the center scatter the errors
    const Errors coarse = errorsAt(GetParam().kind, GetParam().coarsening, 8);
    const Errors middle = errorsAt(GetParam().kind, GetParam().coarsening, 16);
    const Errors fine = errorsAt(GetParam().kind, GetParam().coarsening, 32);
    std::printf("volume errors %.3e %.3e %.3e, orders %.3f %.3f; area errors %.3e %.3e %.3e, orders %.3f %.3f\n",
                coarse.volume, middle.volume, fine.volume, std::log2(coarse.volume / middle.volume),
                std::log2(middle.volume / fine.volume), coarse.area, middle.area, fine.area,
                std::log2(coarse.area / middle.area), std::log2(middle.area / fine.area));
    EXPECT_GE(std::log2(coarse.volume / middle.volume), kOrder);
    EXPECT_GE(std::log2(middle.volume / fine.volume), kOrder);
    EXPECT_GE(std::log2(coarse.area / middle.area), kOrder);
    EXPECT_GE(std::log2(middle.area / fine.area), kOrder);
}

INSTANTIATE_TEST_SUITE_P(Lattices, CutCells,
                         testing::Values(Case{Lattice::Kind::six, 1}, Case{Lattice::Kind::six, 2},
                                         Case{Lattice::Kind::five, 1}));

}  // namespace
