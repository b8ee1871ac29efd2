#include <vdbfrac/base/triangle.h>

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <cmath>
#include <random>

namespace vdbfrac {
namespace {

using Corners = std::array<Vec3, 3>;

class Random {
public:
    double number() { return at_(source_); }
    Vec3 point() { return {number(), number(), number()}; }

private:
    std::mt19937 source_{1};
    std::uniform_real_distribution<double> at_{-1, 1};
};

/// Least distance over a grid of points of a triangle: never less than the distance, and more by a cell at most.
double sampledDistance(const Corners& t, const Vec3& X, int cells)
{
    double least = 1e300;
    for (int i = 0; i <= cells; ++i)
        for (int j = 0; i + j <= cells; ++j) {
            const double u = double(i) / cells, v = double(j) / cells;
            least = std::min(least, (t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0]) - X).norm());
        }
    return least;
}

/// Barycentric coordinates of a point in the plane of a triangle.
Vec3 sharesOf(const Corners& t, const Vec3& X)
{
    const Vec3 normal = (t[1] - t[0]).cross(t[2] - t[0]);
    const auto area = [&](const Vec3& a, const Vec3& b) {
        return (a - X).cross(b - X).dot(normal) / normal.squaredNorm();
    };
    return {area(t[1], t[2]), area(t[2], t[0]), area(t[0], t[1])};
}

TEST(Triangle, ClosestPointIsNoFartherThanAnyOther)
{
    Random random;
    std::array<int, 3> seen{};
    for (int i = 0; i < 600; ++i) {
        const Corners t{random.point(), random.point(), random.point()};
        const Vec3 X = random.point();
        const ClosestPoint closest = closestPoint(t, X);
        constexpr int kCells = 60;
        const double distance = (closest.at - X).norm(), sampled = sampledDistance(t, X, kCells);
        const double cell = std::max((t[1] - t[0]).norm(), (t[2] - t[0]).norm()) / kCells;
        EXPECT_LE(distance, sampled + 1e-14);
        EXPECT_GE(distance, sampled - cell);
        ++seen[std::size_t(closest.on)];
        const Vec3 shares = sharesOf(t, closest.at);
        EXPECT_GE(shares.minCoeff(), -1e-9);
        EXPECT_NEAR((vdbfrac::sharesOf(t, closest.at) - shares).norm(), 0, 1e-9);
        const auto n = std::size_t(closest.number);
        if (closest.on == ClosestPoint::On::corner) EXPECT_EQ(closest.at, t[n]);
        if (closest.on == ClosestPoint::On::edge) EXPECT_NEAR(shares[int(n + 2) % 3], 0, 1e-9);
    }
    for (int part : seen) EXPECT_GT(part, 20);
}

/// Where corners are one point, a triangle is a segment.
TEST(Triangle, OneWithoutAreaIsASegment)
{
    Random random;
    for (int i = 0; i < 100; ++i) {
        const Vec3 a = random.point(), b = random.point(), X = 2 * random.point();
        const double along = std::clamp((X - a).dot(b - a) / (b - a).squaredNorm(), 0., 1.);
        const double expected = (a + along * (b - a) - X).norm();
        for (const Corners& t : {Corners{a, a, b}, Corners{a, b, b}, Corners{a, b, a}}) {
            const Vec3 closest = closestPoint(t, X).at, shares = vdbfrac::sharesOf(t, X);
            EXPECT_NEAR((closest - X).norm(), expected, 1e-12);
            EXPECT_NEAR((shares[0] * t[0] + shares[1] * t[1] + shares[2] * t[2] - closest).norm(), 0, 1e-12);
        }
        EXPECT_EQ(closestPoint({a, a, a}, X).at, a);
        EXPECT_EQ(vdbfrac::sharesOf({a, a, a}, X).sum(), 1);
    }
}

}  // namespace
}  // namespace vdbfrac
