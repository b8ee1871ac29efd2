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

/// Psi at some voxel nodes, all that tear there: 0 where there is none.
std::vector<double> psiOf(const CutMesh& mesh, const grid::ElementStress& stress, const std::vector<Coord>& front,
                          const grid::TensionAverage& average)
{
    // Energies that rule out no stress.
    const std::vector<double> energy(tetmesh::tetEntry(mesh.elements().size(), 0), 1e300);
    const auto isFront = [&](Coord c) { return std::find(front.begin(), front.end(), c) != front.end(); };
    const grid::TensionAbove above = grid::tensionAbove(0, {mesh, energy, stress, isFront}, average);
    std::vector<double> psi(front.size(), 0);
    for (std::size_t i = 0; i < above.voxels.size(); ++i)
        psi[std::size_t(std::find(front.begin(), front.end(), above.voxels[i]) - front.begin())] = above.psi[i];
    return psi;
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
        const auto psi = psiOf(mesh, stressOf(mesh, uniform(S)), voxels, {3 * dx, kE, kNu});
        EXPECT_NEAR(largest(psi), R, kSums * R);
        for (const double p : psiOf(mesh, stressOf(mesh, uniform(S)), voxels, {0, kE, kNu}))
            ASSERT_NEAR(p, R, kSums * R) << "without an average";
    }
}

TEST_P(Tension, OfWhatIsSqueezedIsNone)
{
    const CutMesh mesh = ball(GetParam());
    const auto voxels = material(mesh, box({-8, -8, -8}, {8, 8, 8}));
    const Mat3 S = Vec3(-1e4, -1, -1e3).asDiagonal();
    for (const double radius : {0., 3 * dx})
        EXPECT_EQ(largest(psiOf(mesh, stressOf(mesh, uniform(S)), voxels, {radius, kE, kNu})), 0);
}

/// Of grips, where nothing may tear.
TEST_P(Tension, OfMaterialThatDoesNotCountIsLeftOut)
{
    const CutMesh mesh = ball(GetParam());
    const Mat3 S = Vec3(1e4, 0, 0).asDiagonal();
    const auto stress = stressOf(mesh, [&](const Vec3& X) { return X.x() > 2 * dx ? Mat3(1e3 * S) : S; });
    const double R = 1e8 / (2 * kE);
    grid::TensionAverage average{3 * dx, kE, kNu};
    average.isCounted = [](Coord c) { return c.x <= 0; };
    EXPECT_NEAR(largest(psiOf(mesh, stress, material(mesh, box({-8, -8, -8}, {0, 8, 8})), average)), R, kSums * R);
}

/// R = G / (2 l / 3) times the mean of <s1>^2 r over all angles, (1 + sin |t|/2)^2 cos^2 t/2 / (2 pi), with the mean of
/// 1 / r in the ball. Within a cell of the tip stresses are averaged before they are squared: a part h / l of it may be
/// missing.
TEST_P(Tension, AtATipIsTheEnergyReleaseOverTheRadius)
{
    constexpr double kClosedForm = .287, kNarrow = 8 * dx, kRadius = 1.5 * kNarrow;
    for (const double tip : {0., .5 * dx}) {
        const CutMesh mesh = slit(GetParam(), tip);
        const auto psi = psiOf(mesh, stressOf(mesh, tipStress(false, tip)), front(mesh, box({-2, -2, 0}, {2, 2, 0})),
                               {kRadius, kE, 0});
        EXPECT_LT(largest(psi) * kNarrow, kClosedForm) << tip;
        EXPECT_GT(largest(psi) * kNarrow, kClosedForm * (1 - GetParam().spacing() / kNarrow)) << tip;
    }
}

/// The largest Psi above the tip's plane over that below.
double aboveOverBelow(const Lattice& lattice, const std::function<Mat3(const Vec3&)>& field)
{
    const CutMesh mesh = slit(lattice, 0);
    const auto voxels = front(mesh, box({-2, -2, 0}, {2, 2, 0}));
    const auto psi = psiOf(mesh, stressOf(mesh, field), voxels, {3 * dx, kE, kNu});
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

/// The share of nodes before the tip of a slit, and the crack's middle there, by the path that led to it.
grid::TensionAbove aheadOf(const CutMesh& mesh, const std::function<Mat3(const Vec3&)>& field,
                           const grid::CrackPath& path)
{
    const auto stress = stressOf(mesh, field);
    const std::vector<double> energy(tetmesh::tetEntry(mesh.elements().size(), 0), 1e300);
    const auto isFront = [&](Coord c) {
        return mesh.phi()(c) < 0 && mesh.phi()(c) >= -1.5 * dx && c.x >= 0 && std::abs(c.z) < 2;
    };
    return grid::tensionAbove(0, {mesh, energy, stress, isFront, {}, &path}, {3 * dx, kE, kNu});
}

/// A crack that has come along y = offset [voxels].
grid::CrackPath alongY(const CutMesh& mesh, double offset)
{
    grid::CrackPath path(mesh.phi().lower(), mesh.phi().upper());
    for (int z = -4; z <= 4; ++z)
        for (int x = -4; x < 0; ++x) path.add({x, 0, z}, {double(x), offset, double(z)});
    return path;
}

/// Pulled straight across, the nodes before the tip are given points of the plane that the crack came in. Round nodes
/// beside them the mean stress is turned, but their points too are nearer to it than they are.
TEST_P(Tension, OfACrackGoesOnInThePlaneThatItCameIn)
{
    constexpr double kTurned = .1;  // voxels: some degrees, by the diagonals of a lattice, over two or three
    const CutMesh mesh = slit(GetParam(), 0);
    for (const double offset : {-.4, 0., .25}) {
        const grid::TensionAbove above = aheadOf(mesh, tipStress(false, 0), alongY(mesh, offset));
        ASSERT_GT(above.voxels.size(), 3u);
        ASSERT_EQ(above.points.size(), above.voxels.size());
        int before = 0;
        for (std::size_t i = 0; i < above.voxels.size(); ++i) {
            const double node = std::abs(above.voxels[i].y - offset), point = std::abs(above.points[i].y() - offset);
            if (above.voxels[i].y == 0) {
                ++before;
                EXPECT_LT(point, kTurned) << offset;
            } else if (node < .9) {
                EXPECT_LT(point, node) << offset;
            }
        }
        EXPECT_GT(before, 0);
    }
}

/// A path half a voxel up makes the nodes at y = 1 as near as those at y = 0; one at 0 leaves them what H gives.
TEST_P(Tension, OfACrackPrefersNodesThatItsWayMeets)
{
    const CutMesh mesh = slit(GetParam(), 0);
    const auto shareAt = [&](const grid::TensionAbove& above, int y) {
        double share = 0;
        for (std::size_t i = 0; i < above.voxels.size(); ++i)
            if (above.voxels[i].y == y) share = std::max(share, above.share[i]);
        return share;
    };
    for (const int side : {-1, 1}) {
        const grid::TensionAbove middle = aheadOf(mesh, tipStress(false, 0), alongY(mesh, 0));
        const grid::TensionAbove off = aheadOf(mesh, tipStress(false, 0), alongY(mesh, .9 * side));
        EXPECT_GT(shareAt(middle, 0), shareAt(off, 0)) << side;
        EXPECT_GT(shareAt(off, side), shareAt(middle, side)) << side;
        EXPECT_LT(shareAt(middle, side), 1) << side;
    }
}

/// A node's way is less than a voxel off it, or its own: a crack that has turned leaves its old plane.
TEST_P(Tension, OfACrackThatHasTurnedStartsAWayOfItsOwn)
{
    const CutMesh mesh = slit(GetParam(), 0);
    const grid::TensionAbove above = aheadOf(mesh, tipStress(false, 0), alongY(mesh, 2.5));
    ASSERT_GT(above.voxels.size(), 3u);
    for (std::size_t i = 0; i < above.voxels.size(); ++i)
        if (above.voxels[i].y <= 1) {
            EXPECT_EQ(above.points[i], above.voxels[i].toVec());
        }
}

/// Whatever is left out because its energy is too low: the rest is as it is without a resistance.
TEST_P(Tension, AboveAResistanceIsWhatItIsWithoutOne)
{
    const CutMesh mesh = slit(GetParam(), 0);
    const auto stress = stressOf(mesh, tipStress(false, 0));
    std::vector<double> energy(tetmesh::tetEntry(mesh.elements().size(), 0), 0);
    for (std::uint32_t e = 0; e < mesh.elements().size(); ++e)
        for (std::size_t t = 0; t < std::size_t(tetmesh::cellTets(mesh.elements()[e].shape).count); ++t) {
            const Mat3 S = stress(e)[t];
            energy[tetmesh::tetEntry(e, t)] = ((1 + kNu) * S.squaredNorm() - kNu * S.trace() * S.trace()) / (2 * kE);
        }
    const grid::TensionAverage average{3 * dx, kE, kNu};
    const auto isFront = [&](Coord c) {
        return mesh.phi()(c) < 0 && mesh.phi()(c) >= -1.001 * dx && std::abs(c.z) < 9;
    };
    const grid::TensionAbove all = grid::tensionAbove(0, {mesh, energy, stress, isFront}, average);
    for (const double share : {.99, .5, .2}) {
        const double kappa = share * largest(all.psi);
        const grid::TensionAbove above = grid::tensionAbove(kappa, {mesh, energy, stress, isFront}, average);
        grid::TensionAbove expected;
        for (std::size_t i = 0; i < all.voxels.size(); ++i)
            if (all.psi[i] > kappa) expected.voxels.push_back(all.voxels[i]), expected.psi.push_back(all.psi[i]);
        EXPECT_EQ(above.voxels, expected.voxels) << share;
        EXPECT_EQ(above.psi, expected.psi) << share;
        EXPECT_GT(above.voxels.size(), 0u);
        EXPECT_LT(above.stresses, all.stresses);
    }
}

/// Where no other voxel node is within the radius the average is the node's own.
TEST_P(Tension, AveragedOverLessThanAVoxelIsThatOfTheNode)
{
    const CutMesh mesh = slit(GetParam(), 0);
    const auto stress = stressOf(mesh, tipStress(false, 0));
    const std::vector<double> energy(tetmesh::tetEntry(mesh.elements().size(), 0), 1e300);
    const auto isFront = [&](Coord c) { return mesh.phi()(c) < 0 && std::abs(c.z) < 9; };
    const grid::TensionAbove own = grid::tensionAbove(0, {mesh, energy, stress, isFront}, {0, kE, kNu});
    ASSERT_GT(own.voxels.size(), 0u);
    for (const double voxels : {.5, 1.}) {
        const grid::TensionAbove above = grid::tensionAbove(0, {mesh, energy, stress, isFront}, {voxels * dx, kE, kNu});
        EXPECT_EQ(above.voxels, own.voxels) << voxels;
        EXPECT_EQ(above.psi, own.psi) << voxels;
    }
    for (const double voxels : {0., .5, 1.}) {
        const grid::VoxelValues front = grid::tensionAtFront({mesh, energy, stress, isFront}, {voxels * dx, kE, kNu});
        EXPECT_EQ(front.coords, own.voxels) << voxels;
        EXPECT_TRUE(std::ranges::equal(front.scalars, own.psi, {}, {}, [](double psi) { return float(psi); }))
            << voxels;
    }
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
