// Energy from tets to voxels, and the law by which phi moves.
#include <vdbfrac/grid/griffith.h>
#include <vdbfrac/grid/transfer.h>
#include <vdbfrac/lab/samples/block.h>
#include <vdbfrac/tetmesh/nodes_around.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

using namespace vdbfrac;
using tetmesh::CutMesh;
using tetmesh::Lattice;

namespace {

constexpr double dx = 0.1;
constexpr double kSums = 1e-12;  // relative: rounding of sums over some thousand pieces
constexpr int kReach = 9;

CutMesh ball(const Lattice& lattice)
{
    return {lattice, lab::sample({-kReach, -kReach, -kReach}, {kReach, kReach, kReach}, dx,
                                 [](Vec3 p) { return (p - Vec3(.01, .02, -.03)).norm() - .7; })};
}

/// All voxels of the ball's box.
std::vector<Coord> allVoxels()
{
    std::vector<Coord> voxels;
    for (int z = -kReach; z <= kReach; ++z)
        for (int y = -kReach; y <= kReach; ++y)
            for (int x = -kReach; x <= kReach; ++x) voxels.push_back({x, y, z});
    return voxels;
}

/// Removes the material on one side of x = `plane`.
void removeBeyond(CutMesh& mesh, double plane)
{
    std::vector<VoxelPhi> changes;
    for (Coord c : allVoxels())
        if (const float value = std::min(float(dx * c.x - plane), float(3 * dx)); value > mesh.phi()(c))
            changes.push_back({c, value});
    mesh.update(changes);
}

class Transfer : public testing::TestWithParam<Lattice> {};

INSTANTIATE_TEST_SUITE_P(Lattices, Transfer,
                         testing::Values(Lattice{Lattice::Kind::six, 1, dx}, Lattice{Lattice::Kind::six, 2, dx},
                                         Lattice{Lattice::Kind::six, 3, dx}, Lattice{Lattice::Kind::five, 1, dx}),
                         [](const auto& info) {
                             return (info.param.kind == Lattice::Kind::six ? "six" : "five") +
                                    std::to_string(info.param.coarsening);
                         });

TEST_P(Transfer, ConstantEnergyIsThatConstantWhereMaterialIs)
{
    const CutMesh mesh = ball(GetParam());
    const auto voxels = allVoxels();
    const auto constant = [](std::uint32_t, int) { return 7.5; };
    const auto psi = grid::nodalEnergy(mesh, constant, voxels);
    const auto averaged = grid::averagedEnergy(mesh, constant, voxels, 2.5 * dx);
    std::size_t material = 0;
    for (std::size_t i = 0; i < voxels.size(); ++i) {
        if (mesh.seenPhi(voxels[i]) < 0) {
            EXPECT_NEAR(psi[i], 7.5, kSums * 7.5);
            ++material;
        }
        EXPECT_TRUE(psi[i] == 0 || std::abs(psi[i] - 7.5) < kSums * 7.5) << psi[i];
        EXPECT_TRUE(averaged[i] == 0 || std::abs(averaged[i] - 7.5) < kSums * 7.5) << averaged[i];
        EXPECT_EQ(psi[i] == 0, grid::nodalVolume(mesh, voxels[i]) == 0);
    }
    EXPECT_GT(material, 1000u);
}

TEST_P(Transfer, NodalVolumesAddUpToTheMesh)
{
    CutMesh mesh = ball(GetParam());
    for (double plane : {1e9, .213, -.4}) {
        removeBeyond(mesh, plane);
        double sum = 0;
        for (Coord c : allVoxels()) sum += grid::nodalVolume(mesh, c);
        EXPECT_NEAR(sum * dx * dx * dx, mesh.volume(), kSums * mesh.volume());
    }
}

TEST_P(Transfer, VoxelsAboveAreThoseOfHotTets)
{
    const CutMesh mesh = ball(GetParam());
    std::mt19937 random(3);
    for (double share : {0., .0002, .002, .05, 1.}) {
        std::bernoulli_distribution hot(share);
        std::vector<double> density(mesh.elements().size() * tetmesh::kMaxTets);
        for (double& d : density) d = hot(random) ? 2 : 1;
        // Energies above the threshold count 1, others 0: the voxels that get any of it.
        const auto energy = [&](std::uint32_t e, int t) {
            return density[e * tetmesh::kMaxTets + std::size_t(t)] > 1.5 ? 1. : 0.;
        };
        const auto voxels = allVoxels();
        const auto psi = grid::nodalEnergy(mesh, energy, voxels);
        std::vector<Coord> expected;
        for (std::size_t i = 0; i < voxels.size(); ++i)
            if (psi[i] > 0) expected.push_back(voxels[i]);
        std::sort(expected.begin(), expected.end());
        EXPECT_EQ(mesh.voxelsAbove(density, 1.5), expected) << share;
    }
}

TEST_P(Transfer, WhatHasFailedDoesNotDilute)
{
    // Energy 5 at x < 0, 1 beyond. Nodes of the plane see both; with the weak half gone they see 5, not some part of
    // it.
    CutMesh mesh = ball(GetParam());
    const auto energyOf = [&mesh](std::uint32_t e, int t) {
        const auto& element = mesh.elements()[e];
        double x = 0;
        for (int c : tetmesh::cellTets(element.shape).corner[std::size_t(t)])
            x += 0.25 * mesh.nodes()[element.node[std::size_t(c)]].x;
        return x < 0 ? 5. : 1.;
    };
    const std::vector<Coord> plane{{0, 0, 0}, {0, 1, 2}, {0, -3, 2}};
    for (double psi : grid::nodalEnergy(mesh, energyOf, plane)) EXPECT_TRUE(psi > 1.5 && psi < 4.5) << psi;
    removeBeyond(mesh, 0);
    for (double psi : grid::nodalEnergy(mesh, energyOf, plane)) EXPECT_NEAR(psi, 5, kSums * 5);
    for (double psi : grid::averagedEnergy(mesh, energyOf, plane, 2.2 * dx)) EXPECT_NEAR(psi, 5, kSums * 5);
}

TEST_P(Transfer, AverageOverLessThanAVoxelIsTheNodalEnergy)
{
    const CutMesh mesh = ball(GetParam());
    std::mt19937 random(4);
    std::vector<double> density(mesh.elements().size() * tetmesh::kMaxTets);
    for (double& d : density) d = double(random() % 1000);
    const auto energy = [&](std::uint32_t e, int t) { return density[e * tetmesh::kMaxTets + std::size_t(t)]; };
    const auto voxels = allVoxels();
    EXPECT_EQ(grid::averagedEnergy(mesh, energy, voxels, .99 * dx), grid::nodalEnergy(mesh, energy, voxels));
}

// --- the front -----------------------------------------------------------------------------------------------------

grid::GriffithStep stepOf(double kappa, double epsilon, double s, double maxMove = 1e9)
{
    grid::GriffithStep step;
    step.kappa = kappa, step.epsilon = epsilon, step.s = s, step.maxMove = maxMove;
    return step;
}

TEST_P(Transfer, AverageIsTheWeightedSumOverItsBall)
{
    const CutMesh mesh = ball(GetParam());
    std::mt19937 random(8);
    std::uniform_real_distribution<double> any(0, 5);
    std::vector<double> density(mesh.elements().size() * tetmesh::kMaxTets);
    for (double& d : density) d = any(random);
    const auto energy = [&](std::uint32_t e, int t) { return density[e * tetmesh::kMaxTets + std::size_t(t)]; };
    const double radius = 3.4 * dx;
    // Far apart: not one block for all.
    const std::vector<Coord> centers = {{0, 0, 0}, {-8, 0, 1}, {5, 4, -3}, {9, 9, 9}};
    const std::vector<Coord> voxels = allVoxels();
    const auto psi = grid::nodalEnergy(mesh, energy, voxels);
    const auto averaged = grid::averagedEnergy(mesh, energy, centers, radius);
    for (std::size_t k = 0; k < centers.size(); ++k) {
        double volume = 0, sum = 0;
        for (std::size_t i = 0; i < voxels.size(); ++i) {
            const double r2 = (dx * (voxels[i] - centers[k]).toVec()).squaredNorm() / (radius * radius);
            if (r2 >= 1) continue;
            const double part = (1 - r2) * (1 - r2) * grid::nodalVolume(mesh, voxels[i]);
            volume += part, sum += part * psi[i];
        }
        EXPECT_NEAR(averaged[k], volume > 0 ? sum / volume : 0, kSums * 5) << k;
    }
}

TEST(NodesAround, AreThoseOfAllBoxes)
{
    std::mt19937 random(4);
    std::uniform_int_distribution<int> place(-20, 20);
    for (int reach : {0, 1, 3})
        for (int count : {0, 1, 40}) {
            std::vector<Coord> voxels, expected;
            for (int i = 0; i < count; ++i) voxels.push_back({place(random), place(random), place(random)});
            for (const Coord& c : voxels)
                for (int z = -reach; z <= reach; ++z)
                    for (int y = -reach; y <= reach; ++y)
                        for (int x = -reach; x <= reach; ++x) expected.push_back(c + Coord{x, y, z});
            std::sort(expected.begin(), expected.end());
            expected.erase(std::unique(expected.begin(), expected.end()), expected.end());
            EXPECT_EQ(tetmesh::nodesAround(voxels, reach), expected) << reach << " " << count;
        }
}

TEST(Griffith, UpdateIntegratesTheLaw)
{
    constexpr double kIntegration = 1e-9;  // of epsilon: error of the 4000 steps of fourth order
    constexpr int kSteps = 4000;
    const double eps = .012, kappa = 40;
    for (double phi0 : {-.05, -.02, -.003, 0., .01})
        for (double psi : {41., 80., 400.})
            for (double s : {1e-7, 1e-5, 1e-4}) {
                const auto rate = [&](double p) {
                    return eps / (eps * eps + p * p) * (psi - kappa) / std::numbers::pi;
                };
                double p = phi0;
                const double ds = s / kSteps;
                for (int n = 0; n < kSteps; ++n) {
                    const double a = rate(p), b = rate(p + .5 * ds * a), c = rate(p + .5 * ds * b),
                                 d = rate(p + ds * c);
                    p += ds / 6 * (a + 2 * b + 2 * c + d);
                }
                EXPECT_NEAR(grid::griffithUpdate(phi0, psi, stepOf(kappa, eps, s)), p, kIntegration * eps)
                    << phi0 << ' ' << psi << ' ' << s;
            }
}

TEST(Griffith, CrossingTakesTheTimeOfTheFormula)
{
    constexpr double kRounding = 1e-12;  // of epsilon
    const double eps = .012, kappa = 40, psi = 65;
    for (double d : {1e-6, .001, .01, .1}) {
        const double s = std::numbers::pi / (psi - kappa) * (eps * d + d * d * d / (3 * eps));
        EXPECT_NEAR(grid::griffithUpdate(-d, psi, stepOf(kappa, eps, s)), 0,
                    kRounding * eps * std::max(1., std::pow(d / eps, 3)));
        EXPECT_LT(grid::griffithUpdate(-d, psi, stepOf(kappa, eps, .999 * s)), 0);
        EXPECT_GT(grid::griffithUpdate(-d, psi, stepOf(kappa, eps, 1.001 * s)), 0);
        // Two halves of a step make the whole.
        const double half = grid::griffithUpdate(-d, psi, stepOf(kappa, eps, s / 2));
        EXPECT_NEAR(grid::griffithUpdate(half, psi, stepOf(kappa, eps, s / 2)), 0,
                    kRounding * eps * std::max(1., std::pow(d / eps, 3)));
    }
}

TEST(Griffith, PhiNeverFallsAndNeverMovesMoreThanAllowed)
{
    std::mt19937 random(6);
    std::uniform_real_distribution<double> place(-.3, .3), energy(0, 200), exponent(-12, 3);
    for (int trial = 0; trial < 20000; ++trial) {
        const double phi = place(random), most = .05, psi = energy(random);
        const double next = grid::griffithUpdate(phi, psi, stepOf(100, .012, std::pow(10, exponent(random)), most));
        ASSERT_GE(next, phi);
        ASSERT_LE(next, phi + most);
        if (psi <= 100) {
            ASSERT_EQ(next, phi);
        }
    }
    EXPECT_EQ(grid::griffithUpdate(-.01, 1e300, stepOf(1, .012, 1e9, .05)), -.01 + .05);
    EXPECT_EQ(grid::griffithUpdate(-.01, 500, stepOf(1, .012, 1, 0)), -.01);
}

TEST(Griffith, EndlessResistanceNeverMoves)
{
    for (double phi : {-.1, 0., .1})
        for (double psi : {0., 1e9, 1e200}) EXPECT_EQ(grid::griffithUpdate(phi, psi, stepOf(1e300, .012, 1e9)), phi);
}

TEST(Griffith, RayleighSpeedMatchesFreund)
{
    // c_s (.862 + 1.14 nu) / (1 + nu); the exact root of Rayleigh's equation at nu = .25 is .9194 c_s.
    EXPECT_NEAR(grid::rayleighSpeed(4e4, .3, 1000), std::sqrt(40.) * (.862 + .342) / 1.3, 1e-12);
    EXPECT_NEAR(grid::rayleighSpeed(1, .25, 1), .9194, .002);  // the fit's own error
}

/// (2 - y)^2 = 4 sqrt(1 - y) sqrt(1 - a y) with y = (c / c_s)^2, a = (c_s / c_p)^2 (Freund 1990, section 2.5).
TEST(Griffith, RayleighSpeedSolvesItsEquationForAllPoissonRatios)
{
    constexpr double kFit = .015;  // largest at nu = 0, in Freund's
    for (double nu = -.99; nu < .5; nu += .03) {
        const double a = (1 - 2 * nu) / (2 * (1 - nu));
        const auto f = [&](double y) { return (2 - y) * (2 - y) - 4 * std::sqrt((1 - y) * (1 - a * y)); };
        double low = .01, high = 1;
        for (int i = 0; i < 60; ++i) (f((low + high) / 2) < 0 ? low : high) = (low + high) / 2;
        EXPECT_NEAR(grid::rayleighSpeed(1, nu, 1) / std::sqrt(low), 1, kFit) << nu;
    }
}

}  // namespace
