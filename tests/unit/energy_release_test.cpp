// G of cracks from displacements that are known: round a tip, beside a smooth face.
#include <vdbfrac/grid/energy_release.h>
#include <vdbfrac/lab/samples/block.h>
#include <vdbfrac/solver/element.h>
#include <vdbfrac/tetmesh/cut_mesh.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

using namespace vdbfrac;
using tetmesh::CutMesh;
using tetmesh::Lattice;

namespace {

constexpr double dx = .1, kE = 2e5;
constexpr int kReach = 14;

solver::Material material(double nu) { return solver::makeMaterial(kE, nu, 1000); }

using Displacement = std::function<Vec3(const Vec3& X, double side)>;

/// x of all nodes. `side`: of the plane y = 0 on which the material of a node lies, 1 or -1.
std::vector<Vec3> moved(const CutMesh& mesh, const Displacement& u)
{
    std::vector<double> side(mesh.nodeCount(), 0);
    for (const tetmesh::CellElement& e : mesh.elements()) {
        double y = 0;
        for (const std::uint32_t n : e.node) y += mesh.restPosition(n).y();
        for (const std::uint32_t n : e.node) side[n] += y;
    }
    std::vector<Vec3> x(mesh.nodeCount());
    for (std::size_t n = 0; n < x.size(); ++n) {
        const Vec3 X = mesh.restPosition(n);
        x[n] = X + u(X, side[n] < 0 ? -1 : 1);
    }
    return x;
}

/// Round a tip on the x axis in plane strain, opened or sheared, so little that G stands for small strains.
Displacement roundTip(double K, double nu, double tip, bool isShear)
{
    const double mu = kE / (2 * (1 + nu)), kappa = 3 - 4 * nu;
    return [=](const Vec3& X, double side) {
        const double px = X.x() - tip, r = std::hypot(px, X.y());
        const double angle = X.y() == 0 && px < 0 ? side * std::numbers::pi : std::atan2(X.y(), px);
        const double s = std::sin(angle / 2), c = std::cos(angle / 2),
                     size = K / (2 * mu) * std::sqrt(r / (2 * std::numbers::pi));
        return isShear ? Vec3(size * s * (kappa + 1 + 2 * c * c), -size * c * (kappa - 1 - 2 * s * s), 0)
                       : Vec3(size * c * (kappa - 1 + 2 * s * s), size * s * (kappa + 1 - 2 * c * c), 0);
    };
}

/// Of a thin slit along z that ends at `tip` on the x axis; |z| < thick / 2 [m].
CutMesh slit(const Lattice& lattice, double tip, double thick)
{
    return {lattice, lab::sample({-kReach, -kReach, -kReach}, {kReach, kReach, kReach}, dx, [=](const Vec3& p) {
                const double gap = .3 * dx - std::hypot(std::max(0., p.x() - tip + .3 * dx), p.y());
                return std::max(gap, std::abs(p.z()) - thick / 2);
            })};
}

double largestRelease(const CutMesh& mesh, const std::vector<Vec3>& x, double nu, double radius)
{
    std::vector<Coord> tips;
    for (int k = 0; k < 25; ++k)
        if (const Coord c{k % 5 - 2, k / 5 - 2, 0}; mesh.phi()(c) < 0) tips.push_back(c);
    const auto forces = [&](std::uint32_t e) {
        return solver::elementForces({mesh.elements()[e], nullptr, mesh.spacing()}, x, material(nu),
                                     solver::Elasticity(solver::Volumetric::cell, solver::Strain::corotational, .75));
    };
    double largest = 0;
    for (const grid::Release& release : grid::energyRelease(mesh, forces, tips, radius, {}))
        largest = std::max(largest, release.G);
    return largest;
}

class EnergyRelease : public testing::TestWithParam<Lattice> {};

INSTANTIATE_TEST_SUITE_P(Lattices, EnergyRelease,
                         testing::Values(Lattice{Lattice::Kind::six, 1, dx}, Lattice{Lattice::Kind::six, 2, dx},
                                         Lattice{Lattice::Kind::five, 1, dx}),
                         [](const auto& info) {
                             return (info.param.kind == Lattice::Kind::six ? "six" : "five") +
                                    std::to_string(info.param.coarsening);
                         });

constexpr double kFound = .95;  // of G, what a lattice finds in equilibrium
constexpr double kInterpolated =
    .25;  // of G: nodes that are put where the field has them hold more energy than they would

TEST_P(EnergyRelease, OfATipIsThatOfItsStressIntensity)
{
    constexpr double kG = 1e-3;  // J/m^2
    for (const double nu : {0., .3})
        for (const bool isShear : {false, true}) {
            const CutMesh mesh = slit(GetParam(), 0, 1e3);
            const double K = std::sqrt(kG * kE / (1 - nu * nu));
            const double G =
                largestRelease(mesh, moved(mesh, roundTip(K, nu, 0, isShear)), nu, 4 * GetParam().spacing());
            EXPECT_NEAR(kFound * G / kG, 1, kInterpolated) << nu << " " << isShear;
        }
}

/// Of a plate, whose faces hold material too: only the front moves.
TEST_P(EnergyRelease, OfAPlateIsThatOfItsFront)
{
    constexpr double kG = 1e-3;  // J/m^2
    const double nu = 0, thick = 4 * GetParam().spacing();
    const CutMesh mesh = slit(GetParam(), 0, thick);
    const double G =
        largestRelease(mesh, moved(mesh, roundTip(std::sqrt(kG * kE), nu, 0, false)), nu, 4 * GetParam().spacing());
    EXPECT_NEAR(kFound * G / kG, 1, kInterpolated);
}

/// Beside a face that is pulled along: the energy density times the integral of q over the face, over that along a
/// line.
TEST_P(EnergyRelease, OfASmoothFaceIsItsEnergyTimesTheRadius)
{
    constexpr double kStrain = 1e-4, kSum = .06;
    const CutMesh mesh{GetParam(), lab::sample({-kReach, -kReach, -kReach}, {kReach, kReach, kReach}, dx,
                                               [](const Vec3& p) { return -p.x() - .5 * dx; })};
    const auto q = [](double r) {
        const double s = std::max(0., (r - .4) / .6);
        return r < 1 ? (1 - s * s) * (1 - s * s) : 0;
    };
    double face = 0, line = 0;
    constexpr int kParts = 2000;
    for (int i = 0; i < kParts; ++i) {
        const double r = (i + .5) / kParts;
        face += 2 * std::numbers::pi * r * q(r) / kParts, line += 2 * q(r) / kParts;
    }
    const double radius = 4 * GetParam().spacing(), W = kE * kStrain * kStrain / 2;
    const std::vector<Vec3> x = moved(mesh, [](const Vec3& X, double) { return Vec3(0, kStrain * X.y(), 0); });
    const double G = largestRelease(mesh, x, 0, radius);
    EXPECT_NEAR(kFound * G, W * radius * face / line, kSum * W * radius * face / line);
}

}  // namespace
