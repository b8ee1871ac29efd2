// Polygons in space as triangles.
#include <vdbfrac/tetmesh/planar.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <set>
#include <vector>

using namespace vdbfrac;

namespace {

using Triangle = std::array<std::uint32_t, 3>;

std::vector<Triangle> trianglesOf(const std::vector<Vec3>& corners)
{
    std::vector<Triangle> all;
    tetmesh::eachTriangle(corners, [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        all.push_back({a, b, c});
    });
    return all;
}

std::vector<Vec3> inSpace(const std::vector<std::array<double, 2>>& flat)
{
    const Mat3 turn = Eigen::AngleAxisd(1.1, Vec3(1, 2, -.5).normalized()).toRotationMatrix();
    std::vector<Vec3> corners;
    for (const auto& [u, v] : flat) corners.push_back(turn * Vec3(u, v, 0) + Vec3(3, -2, 1));
    return corners;
}

/// All triangles look the same way and have area; each edge of the outline is one of theirs, others have two.
void expectDivided(const std::vector<Vec3>& corners, double area)
{
    constexpr double kRounding = 1e-12;
    const std::vector<Triangle> triangles = trianglesOf(corners);
    ASSERT_EQ(triangles.size() + 2, corners.size());
    Vec3 sum = Vec3::Zero();
    std::multiset<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const Triangle& t : triangles) {
        const Vec3 own = .5 * (corners[t[1]] - corners[t[0]]).cross(corners[t[2]] - corners[t[0]]);
        EXPECT_GT(own.norm(), 1e-6 * area);
        sum += own;
        for (std::size_t k = 0; k < 3; ++k) edges.insert({t[k], t[(k + 1) % 3]});
    }
    EXPECT_NEAR(sum.norm(), area, kRounding);
    for (const auto& [a, b] : edges) {
        EXPECT_EQ(edges.count({a, b}), 1u);
        EXPECT_EQ(edges.count({b, a}), b == (a + 1) % corners.size() ? 0u : 1u);
    }
    for (const Triangle& t : triangles)
        EXPECT_GT((corners[t[1]] - corners[t[0]]).cross(corners[t[2]] - corners[t[0]]).dot(sum), 0);
}

TEST(Polygon, ThatIsConcaveIsDividedInside)
{
    expectDivided(inSpace({{0, 0}, {4, 0}, {4, 3}, {2, 1}, {0, 3}}), 8);  // notched from above
    expectDivided(inSpace({{2, 1}, {0, 3}, {0, 0}, {4, 0}, {4, 3}}), 8);
    std::vector<std::array<double, 2>> star;
    for (int k = 0; k < 40; ++k) {
        const double r = k % 2 == 0 ? 1 : .3, angle = 2 * std::acos(-1.) * k / 40;
        star.push_back({r * std::cos(angle), r * std::sin(angle)});
    }
    expectDivided(inSpace(star), 20 * .3 * std::sin(2 * std::acos(-1.) / 40));
}

TEST(Polygon, WithCornersInALineHasNoFlatTriangles)
{
    expectDivided(inSpace({{0, 0}, {1, 0}, {2, 0}, {3, 0}, {3, 2}, {0, 2}}), 6);
    expectDivided(inSpace({{1, 0}, {2, 0}, {3, 0}, {3, 2}, {0, 2}, {0, 0}}), 6);
}

TEST(Polygon, ThatIsConvexOrMeetsItselfIsAFan)
{
    const auto isFan = [](const std::vector<Vec3>& corners) {
        const std::vector<Triangle> all = trianglesOf(corners);
        for (std::uint32_t k = 0; k < all.size(); ++k)
            if (all[k] != Triangle{0, k + 1, k + 2}) return false;
        return all.size() + 2 == corners.size();
    };
    EXPECT_TRUE(isFan(inSpace({{0, 0}, {2, 0}, {2.5, 1}, {2, 2}, {0, 2}})));
    std::vector<Vec3> bent = inSpace({{0, 0}, {2, 0}, {2, 2}, {0, 2}});
    bent[2] += Vec3(.1, .1, .1);
    EXPECT_TRUE(isFan(bent));
    EXPECT_TRUE(isFan(inSpace({{0, 0}, {2, 2}, {2, 0}, {0, 2}})));  // a bow
    EXPECT_TRUE(isFan(inSpace({{0, 0}, {0, 0}, {2, 0}, {2, 2}, {0, 2}})));
}

}  // namespace
