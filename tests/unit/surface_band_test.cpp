// Distances round a drawn surface, voxel by voxel: against all of its triangles, and the signs against its solids.
#include "surface_band.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/base/triangle.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

using namespace vdbfrac;
using grid::SurfaceBand;
using tetmesh::Surface;

namespace {

constexpr double kDx = .1;
constexpr double kRounding = 2e-6;  // voxels: distances are floats
/// Voxels: a triangle that none of a voxel's neighbours is closest to is missed.
constexpr double kMissed = .1;

/// A turned box.
struct Box {
    Vec3 middle, half;  // m
    Mat3 turn = Mat3::Identity();

    bool holds(const Vec3& X) const { return ((turn.transpose() * (X - middle)).cwiseAbs() - half).maxCoeff() < 0; }
};

/// Adds the faces of a box, each as `parts` x `parts` squares of two triangles; inside out if so told.
void add(Surface& surface, const Box& box, int parts, bool isInsideOut = false)
{
    for (int face = 0; face < 6; ++face) {
        const int a = face / 2, b = (a + 1) % 3, c = (a + 2) % 3;
        const double side = face % 2 ? 1 : -1;
        const auto first = std::uint32_t(surface.points.size());
        for (int i = 0; i <= parts; ++i)
            for (int j = 0; j <= parts; ++j) {
                Vec3 X;
                X[a] = side, X[b] = 2. * i / parts - 1, X[c] = 2. * j / parts - 1;
                surface.points.push_back(box.middle + box.turn * X.cwiseProduct(box.half));
            }
        for (int i = 0; i < parts; ++i)
            for (int j = 0; j < parts; ++j) {
                const auto at = [&](int di, int dj) { return first + std::uint32_t((i + di) * (parts + 1) + j + dj); };
                std::array<std::uint32_t, 3> lower{at(0, 0), at(1, 0), at(1, 1)}, upper{at(0, 0), at(1, 1), at(0, 1)};
                if ((side < 0) != isInsideOut) std::swap(lower[1], lower[2]), std::swap(upper[1], upper[2]);
                surface.triangles.insert(surface.triangles.end(), {lower, upper});
            }
    }
    surface.fragment.resize(surface.triangles.size());
}

double distanceTo(const Surface& surface, const Vec3& X)
{
    double least = 1e9;
    for (const auto& t : surface.triangles)
        least = std::min(
            least, (closestPoint({surface.points[t[0]], surface.points[t[1]], surface.points[t[2]]}, X).at - X).norm());
    return least;
}

/// Calls visit(voxel, phi [voxels], triangle) for those of the band.
template <class Visit>
void eachOf(const SurfaceBand& band, const Visit& visit)
{
    for (const SurfaceBand::Block& block : band.blocks)
        for (int i = 0; i < SurfaceBand::kVoxels; ++i)
            if (block.closest[std::size_t(i)] != SurfaceBand::kFar)
                visit(block.low + SurfaceBand::placeOf(i), double(block.phi[std::size_t(i)]),
                      block.closest[std::size_t(i)]);
}

/// Sizes of the parts that voxels outside make up, by 26 neighbours.
std::multiset<std::size_t> outsideParts(const SurfaceBand& band)
{
    std::map<Coord, bool> outside;  // seen?
    for (const SurfaceBand::Block& block : band.blocks)
        for (int i = 0; i < SurfaceBand::kVoxels; ++i)
            if (block.phi[std::size_t(i)] >= 0) outside[block.low + SurfaceBand::placeOf(i)] = false;
    std::multiset<std::size_t> sizes;
    for (auto& [start, seen] : outside) {
        if (seen) continue;
        std::vector<Coord> open{start};
        seen = true;
        std::size_t size = 0;
        for (; !open.empty(); ++size) {
            const Coord c = open.back();
            open.pop_back();
            for (int n = 0; n < 27; ++n) {
                const auto at = outside.find(c + Coord{n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1});
                if (at != outside.end() && !at->second) at->second = true, open.push_back(at->first);
            }
        }
        sizes.insert(size);
    }
    return sizes;
}

/// Two boxes with a gap [voxels] between them, turned so that no row of voxels runs along it.
Surface slit(double gap, double angle, double shift)
{
    const Mat3 turn = Eigen::AngleAxisd(angle, Vec3(.1, .6, 1).normalized()).toRotationMatrix();
    Surface surface;
    for (const double side : {-1., 1.})
        add(surface, {turn * Vec3(side * (.5 + .5 * gap * kDx) + shift * kDx, 0, 0), Vec3(.5, .73, .61), turn}, 14);
    return surface;
}

const Mat3 kTurn = Eigen::AngleAxisd(.7, Vec3(1, 2, -.5).normalized()).toRotationMatrix();

TEST(SurfaceBand, IsTheDistanceToTheSurfaceWithTheSignOfTheSolid)
{
    const Box one{{.03, -.02, .01}, {.8, .5, .4}, kTurn}, other{{.5, .3, .2}, {.4, .4, .4}, kTurn * kTurn};
    Surface surface;
    add(surface, one, 9), add(surface, other, 3);
    const SurfaceBand band = grid::surfaceBand(surface, kDx);
    std::size_t count = 0;
    double off = 0;
    eachOf(band, [&](const Coord& c, double phi, std::uint32_t triangle) {
        const Vec3 X = kDx * c.toVec();
        const double exact = distanceTo(surface, X) / kDx;
        const auto& t = surface.triangles[triangle];
        const double own =
            (closestPoint({surface.points[t[0]], surface.points[t[1]], surface.points[t[2]]}, X).at - X).norm();
        EXPECT_NEAR(own / kDx, std::abs(phi), kRounding) << c.x << " " << c.y << " " << c.z;
        if (exact <= 1) {
            EXPECT_NEAR(std::abs(phi), exact, kRounding) << c.x << " " << c.y << " " << c.z;
        }
        off = std::max(off, std::abs(phi) - exact);
        if (std::abs(phi) > kRounding) {
            EXPECT_EQ(phi < 0, one.holds(X) || other.holds(X)) << c.x << " " << c.y << " " << c.z << " phi " << phi;
        }
        ++count;
    });
    std::printf("%zu voxels, at most %.4f voxels off\n", count, off);
    // None of the band is missing, but where a distance of nearly its width was found too large.
    std::size_t expected = 0;
    for (int x = -20; x <= 20; ++x)
        for (int y = -20; y <= 20; ++y)
            for (int z = -20; z <= 20; ++z) expected += distanceTo(surface, kDx * Vec3(x, y, z)) < (3 - kMissed) * kDx;
    EXPECT_GE(count, expected);
    EXPECT_LT(off, kMissed);
}

TEST(SurfaceBand, FacesOnVoxelPlanesAndHollowsHaveSigns)
{
    const Box box{{0, 0, 0}, {.6, .5, .4}}, hollow{{0, 0, 0}, {.2, .2, .2}};
    Surface surface;
    add(surface, box, 12), add(surface, hollow, 4, true);
    eachOf(grid::surfaceBand(surface, kDx), [&](const Coord& c, double phi, std::uint32_t) {
        if (std::abs(phi) < kRounding) return;  // on a face it has either
        const Vec3 X = kDx * c.toVec();
        EXPECT_EQ(phi < 0, box.holds(X) && !hollow.holds(X)) << c.x << " " << c.y << " " << c.z;
    });
}

TEST(SurfaceBand, NarrowGapsLeaveNoSpecks)
{
    for (const double gap : {0., .01, .1, .3, .6})
        for (const double angle : {0., .08, .4})
            for (const double shift : {0., .3}) {
                const auto parts = outsideParts(grid::surfaceBand(slit(gap, angle, shift), kDx));
                EXPECT_EQ(parts.size(), 1u) << "gap " << gap << " angle " << angle << " shift " << shift;
            }
    // In a slit along voxels they are beside each other, and lead out.
    std::size_t within = 0;
    eachOf(grid::surfaceBand(slit(.2, 0, 0), kDx), [&](const Coord& c, double phi, std::uint32_t) {
        within += c.x == 0 && phi >= 0 && std::abs(phi - .1) < .01;
    });
    EXPECT_EQ(within, 15u * 13u);
}

/// The box round such a one holds a million blocks.
TEST(SurfaceBand, ALongSliverTakesOnlyWhatIsNearIt)
{
    Surface surface;
    surface.points = {{0, 0, 0}, {90, 91, 92}, {90.05, 91, 92}, {90, 91.05, 92}};
    surface.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    surface.fragment.resize(4);
    EXPECT_LT(grid::surfaceBand(surface, kDx).blocks.size(), 2500u);
}

TEST(SurfaceBand, HasTheSameBitsForAnyNumberOfThreads)
{
    const auto bits = [](int threads) {
        const ThreadLimit limit(threads);
        std::vector<std::pair<double, std::uint32_t>> all;
        eachOf(grid::surfaceBand(slit(.7, .4, .1), kDx),
               [&](const Coord&, double phi, std::uint32_t n) { all.emplace_back(phi, n); });
        return all;
    };
    EXPECT_EQ(bits(1), bits(3));
}

TEST(SurfaceBand, RefusesWhatNoGridHolds)
{
    Surface surface = slit(.5, 0, 0);
    EXPECT_THROW(grid::surfaceBand(surface, 0), Error);
    EXPECT_THROW(grid::surfaceBand(surface, 1e-8), Error);
    surface.points[3].x() = std::nan("");
    EXPECT_THROW(grid::surfaceBand(surface, kDx), Error);
    surface = slit(.5, 0, 0);
    surface.triangles[5][1] = 123456;
    EXPECT_THROW(grid::surfaceBand(surface, kDx), Error);
    EXPECT_TRUE(grid::surfaceBand({}, kDx).blocks.empty());
}

/// What flies off is far from the origin, and no larger than before.
TEST(SurfaceBand, IsThatOfASurfaceFarAway)
{
    const Surface near = slit(.5, 0, 0);
    Surface far = near;
    const Vec3 away = kDx * 8 * Vec3(1 << 22, -(1 << 20), 1 << 10);  // whole blocks
    for (Vec3& X : far.points) X += away;
    EXPECT_EQ(grid::surfaceBand(far, kDx).blocks.size(), grid::surfaceBand(near, kDx).blocks.size());
}

}  // namespace
