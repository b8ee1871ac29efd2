// The tension that opens a crack: from stresses that are known, as round the tip of a crack.
#include <vdbfrac/grid/tension.h>
#include <vdbfrac/grid/transfer.h>
#include <vdbfrac/lab/samples/block.h>
#include <vdbfrac/lab/samples/loads.h>
#include <vdbfrac/tetmesh/cut_mesh.h>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

using namespace vdbfrac;
using tetmesh::CutMesh;
using tetmesh::Lattice;

namespace {

constexpr double dx = .1, kE = 2e5, kNu = .3;
constexpr double kSums = 1e-11;  // relative: rounding of sums over some thousand pieces, and of eigenvalues
constexpr int kReach = 12;

std::vector<Coord> box(Coord lower, Coord upper)
{
    std::vector<Coord> voxels;
    for (int z = lower.z; z <= upper.z; ++z)
        for (int y = lower.y; y <= upper.y; ++y)
            for (int x = lower.x; x <= upper.x; ++x) voxels.push_back({x, y, z});
    return voxels;
}

std::vector<Coord> material(const CutMesh& mesh, std::vector<Coord> voxels)
{
    std::erase_if(voxels, [&](const Coord& c) { return mesh.phi()(c) >= 0; });
    return voxels;
}

/// Material that touches the surface.
std::vector<Coord> front(const CutMesh& mesh, std::vector<Coord> voxels)
{
    voxels = material(mesh, std::move(voxels));
    std::erase_if(voxels, [&](const Coord& c) { return mesh.phi()(c) < -1.001 * dx; });
    return voxels;
}

CutMesh ball(const Lattice& lattice)
{
    return {lattice, lab::sample({-9, -9, -9}, {9, 9, 9}, dx,
                                 [](const Vec3& p) { return (p - Vec3(.01, .02, -.03)).norm() - .7; })};
}

/// Material all round a thin slit along z that ends at `tip` [m] on the x axis.
CutMesh slit(const Lattice& lattice, double tip)
{
    return {lattice, lab::sample({-kReach, -kReach, -kReach}, {kReach, kReach, kReach}, dx, [=](const Vec3& p) {
                return .3 * dx - std::hypot(std::max(0., p.x() - tip + .3 * dx), p.y());
            })};
}

/// The same stress in all tets of an element: that of a field at the element's middle.
grid::ElementStress stressOf(const CutMesh& mesh, const std::function<Mat3(const Vec3&)>& field)
{
    return [&mesh, field](std::uint32_t e) {
        const tetmesh::CellElement& element = mesh.elements()[e];
        const tetmesh::CellTets& tets = tetmesh::cellTets(element.shape);
        std::array<Mat3, tetmesh::kMaxTets> stress;
        for (std::size_t t = 0; t < std::size_t(tets.count); ++t) {
            Vec3 middle = Vec3::Zero();
            for (const int corner : tets.corner[t]) middle += mesh.restPosition(element.node[std::size_t(corner)]) / 4;
            stress[t] = field(middle);
        }
        return stress;
    };
}

std::function<Mat3(const Vec3&)> uniform(const Mat3& S)
{
    return [S](const Vec3&) { return S; };
}

/// In plane stress round a tip on the x axis, G = 1 J/m^2 (Anderson, Fracture Mechanics, table 2.1).
std::function<Mat3(const Vec3&)> tipStress(bool isShear, double tip)
{
    return [=](const Vec3& X) {
        const double x = X.x() - tip, r = std::hypot(x, X.y()), half = std::atan2(X.y(), x) / 2;
        const double s = std::sin(half), c = std::cos(half), s3 = std::sin(3 * half), c3 = std::cos(3 * half);
        Mat3 S = Mat3::Zero();
        if (isShear)
            S(0, 0) = -s * (2 + c * c3), S(1, 1) = s * c * c3, S(0, 1) = S(1, 0) = c * (1 - s * s3);
        else
            S(0, 0) = c * (1 - s * s3), S(1, 1) = c * (1 + s * s3), S(0, 1) = S(1, 0) = s * c * c3;
        return Mat3(std::sqrt(kE / (2 * std::numbers::pi * r)) * S);
    };
}

double largest(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }

class Tension : public testing::TestWithParam<Lattice> {};

INSTANTIATE_TEST_SUITE_P(Lattices, Tension,
                         testing::Values(Lattice{Lattice::Kind::six, 1, dx}, Lattice{Lattice::Kind::six, 2, dx},
                                         Lattice{Lattice::Kind::five, 1, dx}),
                         [](const auto& info) {
                             return (info.param.kind == Lattice::Kind::six ? "six" : "five") +
                                    std::to_string(info.param.coarsening);
                         });

/// Of a bar that is pulled: its energy density, wherever it opens most easily.
TEST_P(Tension, OfAStressThatIsTheSameEverywhereIsTheSquareOfItsLargestPull)
{
    const CutMesh mesh = ball(GetParam());
    const auto voxels = material(mesh, box({-8, -8, -8}, {8, 8, 8}));
    std::mt19937 random(3);
    for (int i = 0; i < 5; ++i) {
        const Mat3 half =
                       (Mat3() << lab::randomVec(random, 1e3), lab::randomVec(random, 1e3), lab::randomVec(random, 1e3))
                           .finished(),
                   S = half + half.transpose();
        const double s = std::max(0., Eigen::SelfAdjointEigenSolver<Mat3>(S).eigenvalues()[2]), R = s * s / (2 * kE);
        const auto psi = grid::averagedTension(mesh, stressOf(mesh, uniform(S)), voxels, {3 * dx, kE, kNu});
        EXPECT_NEAR(largest(psi), R, kSums * R);
        for (const double p : grid::averagedTension(mesh, stressOf(mesh, uniform(S)), voxels, {0, kE, kNu}))
            ASSERT_NEAR(p, R, kSums * R) << "without an average";
    }
}

TEST_P(Tension, OfWhatIsSqueezedIsNone)
{
    const CutMesh mesh = ball(GetParam());
    const auto voxels = material(mesh, box({-8, -8, -8}, {8, 8, 8}));
    const Mat3 S = Vec3(-1e4, -1, -1e3).asDiagonal();
    for (const double radius : {0., 3 * dx})
        EXPECT_EQ(largest(grid::averagedTension(mesh, stressOf(mesh, uniform(S)), voxels, {radius, kE, kNu})), 0);
}

/// R = G / l times the mean of <s1>^2 r over all angles, (1 + sin |t|/2)^2 cos^2 t/2 / (2 pi), with the mean of 1 / r
/// in the ball. Within a cell of the tip stresses are averaged before they are squared: a part h / l of it may be
/// missing.
TEST_P(Tension, AtATipIsTheEnergyReleaseOverTheRadius)
{
    constexpr double kClosedForm = .287, kRadius = 8 * dx;
    for (const double tip : {0., .5 * dx}) {
        const CutMesh mesh = slit(GetParam(), tip);
        const auto psi = grid::averagedTension(mesh, stressOf(mesh, tipStress(false, tip)),
                                               front(mesh, box({-2, -2, 0}, {2, 2, 0})), {kRadius, kE, 0});
        EXPECT_LT(largest(psi) * kRadius, kClosedForm) << tip;
        EXPECT_GT(largest(psi) * kRadius, kClosedForm * (1 - GetParam().spacing() / kRadius)) << tip;
    }
}

/// The largest Psi above the tip's plane over that below.
double aboveOverBelow(const Lattice& lattice, const std::function<Mat3(const Vec3&)>& field)
{
    const CutMesh mesh = slit(lattice, 0);
    const auto voxels = front(mesh, box({-2, -2, 0}, {2, 2, 0}));
    const auto psi = grid::averagedTension(mesh, stressOf(mesh, field), voxels, {3 * dx, kE, kNu});
    double above = 0, below = 0;
    for (std::size_t i = 0; i < voxels.size(); ++i)
        if (voxels[i].y != 0) {
            double& side = voxels[i].y > 0 ? above : below;
            side = std::max(side, psi[i]);
        }
    return above / below;
}

/// Lattices have a diagonal: sides that are alike differ by it.
TEST_P(Tension, OfATipThatIsShearedIsOnTheSideThatIsPulled)
{
    constexpr double kAlike = .15, kOnOneSide = 2;
    const auto other = [](const Vec3& X) { return Mat3(-tipStress(true, 0)(X)); };
    EXPECT_NEAR(aboveOverBelow(GetParam(), tipStress(false, 0)), 1, kAlike);
    EXPECT_LT(aboveOverBelow(GetParam(), tipStress(true, 0)), 1 / kOnOneSide);
    EXPECT_GT(aboveOverBelow(GetParam(), other), kOnOneSide);
}

TEST_P(Tension, ExceedsNoResistanceButWhereEnergiesSayThatItMay)
{
    const CutMesh mesh = slit(GetParam(), 0);
    const auto stress = stressOf(mesh, tipStress(false, 0));
    const auto energy = [&](std::uint32_t e, int t) {
        const Mat3 S = stress(e)[std::size_t(t)];
        return ((1 + kNu) * S.squaredNorm() - kNu * S.trace() * S.trace()) / (2 * kE);
    };
    const grid::TensionAverage average{3 * dx, kE, kNu};
    const auto all = front(mesh, box({-9, -2, -3}, {2, 2, 3}));
    const auto psi = grid::averagedTension(mesh, stress, all, average);
    for (const double share : {.99, .5, .2}) {
        const double kappa = share * largest(psi);
        const auto kept = grid::whereTensionMayExceed(kappa, mesh, energy, all, average);
        if (share > .9) {
            EXPECT_LT(kept.size(), all.size());
        }
        const auto again = grid::averagedTension(mesh, stress, kept, average);
        std::size_t seen = 0;
        for (std::size_t i = 0; i < all.size(); ++i) {
            const auto it = std::find(kept.begin(), kept.end(), all[i]);
            if (psi[i] > kappa) {
                ASSERT_NE(it, kept.end()) << share;
                EXPECT_EQ(again[std::size_t(it - kept.begin())], psi[i]);
                ++seen;
            } else if (it != kept.end()) {
                EXPECT_LE(again[std::size_t(it - kept.begin())], kappa);
            }
        }
        EXPECT_GT(seen, 0u);
    }
}

TEST_P(Tension, SeesNoFartherThanItsReach)
{
    const CutMesh mesh = slit(GetParam(), 0);
    const int reach = grid::tensionReach(3 * dx, dx);
    const Coord cube{reach, reach, reach};
    const Mat3 S = Vec3(1e4, 0, 0).asDiagonal();
    std::vector<char> near(mesh.elements().size(), 0);
    for (const Coord& c : box(Coord{1, 0, 0} - cube, Coord{1, 0, 0} + cube))
        mesh.visitTets(c, [&](std::uint32_t e, int, double) { near[e] = 1; });
    ASSERT_GT(std::count(near.begin(), near.end(), 0), 0);
    const auto all = stressOf(mesh, uniform(S));
    const auto nearOnly = [&](std::uint32_t e) {
        auto stress = all(e);
        if (!near[e]) stress.fill(1e3 * S);
        return stress;
    };
    const Coord middle[] = {{1, 0, 0}};
    EXPECT_EQ(grid::averagedTension(mesh, all, middle, {3 * dx, kE, kNu}),
              grid::averagedTension(mesh, nearOnly, middle, {3 * dx, kE, kNu}));
}

/// Hooke's law: E psi = |S|^2 (1 + nu) / 2 - nu tr(S)^2 / 2.
TEST(MinEnergyUnder, IsTheLeastEnergyOfAllStressesWithThatTension)
{
    std::mt19937 random(4);
    for (const double nu : {0., .3, .45}) {
        const auto energy = [&](const Vec3& s) {
            return ((1 + nu) * s.squaredNorm() - nu * s.sum() * s.sum()) / (2 * kE);
        };
        const double tension = 1 / (2 * kE), least = grid::minEnergyUnder(tension, nu);
        const double side = nu / (1 - nu);
        EXPECT_NEAR(energy({1, side, side}), least, kSums * least) << nu;
        for (int i = 0; i < 1000; ++i) {
            const Vec3 s = lab::randomVec(random, 1);
            EXPECT_GE(energy({1, s.y(), s.z()}), least) << nu;
        }
    }
}

}  // namespace
