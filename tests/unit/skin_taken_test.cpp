// What cracks take of the outer surface.
#include "torn_solids.h"

#include <vdbfrac/base/triangle.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace vdbfrac {
namespace {

using namespace test;
using skin::Lips;
using skin::SkinCut;
using skin::Taken;

Triangles takenOf(const SkinCut& cut)
{
    Triangles taken;
    for (const SkinCut::Part& part : cut.taken) taken.push_back(part.corner);
    return taken;
}

/// What is left and what was taken are the whole surface, and meet along all rims.
TEST(SkinTaken, CompletesTheSurface)
{
    for (const Solid& solid : {box(.97, 1), box(.97, 23), ball(1, 7), ball(1, 40)})
        for (const Vec3& normal : kTilts)
            for (const double half : {1., 2.5}) {
                const Plane plane{normal, .03, .4, 0, half};
                const SkinCut cut = cutBy(solid, plane, .1, Lips::asSimulated, {}, Taken::kept);
                const Drawn left = drawn(solid, cut);
                const Drawn whole{left.points, left.outside, takenOf(cut)};
                EXPECT_GT(whole.torn.size(), 10u);
                EXPECT_EQ(Edges(whole).bad(), 0) << solid.name << ", normal " << normal.transpose();
                const double all = area(solid.points, solid.triangles);
                EXPECT_NEAR(area(whole.points, whole.outside) + area(whole.points, whole.torn), all, 1e-12 * all);
            }
}

/// Files have faces whose corners lie in a line or in one place.
TEST(SkinTaken, HasPlacesForFacesWithoutArea)
{
    constexpr double dx = .1, kRounding = 1e-9;
    Solid solid = box(.97, 23);
    const std::size_t faces = solid.triangles.size();
    for (std::size_t f = 0; f < faces; f += 7) {
        const auto [a, b, c] = solid.triangles[f];
        const auto copy = std::uint32_t(solid.points.size());
        solid.points.insert(solid.points.end(), 3, Vec3(.5 * (solid.points[a] + solid.points[b])));
        solid.triangles.insert(solid.triangles.end(), {{a, a, b}, {c, c, c}, {a, copy, b}, {copy, copy + 1, copy + 2}});
    }
    for (const Lips lips : {Lips::closed, Lips::asSimulated})
        for (const Vec3& normal : kTilts) {
            const SkinCut cut = cutBy(solid, {normal, .03, .4}, dx, lips, {}, Taken::kept);
            EXPECT_GT(cut.taken.size(), 10u);
            for (const SkinCut::Point& p : cut.points) {
                ASSERT_TRUE(p.X.allFinite());
                EXPECT_LT(p.X.cwiseAbs().maxCoeff(), .97 + kRounding);
                EXPECT_GT(p.X.cwiseAbs().maxCoeff(), p.skin == SkinCut::kNoSkin ? 0 : .97 - kRounding);
            }
        }
}

TEST(SkinTaken, IsDroppedUnlessItIsKept) { EXPECT_TRUE(cutBy(ball(1, 40), {Vec3::UnitY(), .03}, .1).taken.empty()); }

/// How far points are from the nearest triangle, at most.
double farthest(std::span<const Vec3> points, const std::vector<Vec3>& of, const Triangles& triangles)
{
    double most = 0;
    for (const Vec3& p : points) {
        double nearest = std::numeric_limits<double>::infinity();
        for (const auto& t : triangles)
            nearest = std::min(nearest, (closestPoint({of[t[0]], of[t[1]], of[t[2]]}, p).at - p).norm());
        most = std::max(most, nearest);
    }
    return most;
}

/// With lips closed, whether they meet or the crack is too wide for that, no place of the surface is bare: to rounding
/// where it is flat, by the height of an arc over faces of a voxel and a half where it is round.
TEST(SkinTaken, LeavesNoPlaceBare)
{
    constexpr double dx = .1, kRounding = 1e-9, kArc = .15 * dx;
    constexpr double kTwice = 1.004;  // little is covered twice
    std::mt19937 random(3);
    std::uniform_real_distribution<double> share(0, 1);
    for (const Solid& solid : {box(.97, 1), box(.97, 23), ball(1, 40)})
        for (const Vec3& normal : kTilts)
            for (const double half : {1., 2.5}) {
                const SkinCut cut = cutBy(solid, {normal, .03, .4, .3, half}, dx, Lips::closed, {}, Taken::kept);
                const Drawn left = drawn(solid, cut);
                Triangles skin = left.outside;
                for (const auto& t : takenOf(cut)) skin.push_back(t);
                EXPECT_LT(area(left.points, skin), kTwice * area(solid.points, solid.triangles));
                std::erase_if(skin, [&](const auto& t) {  // far from the crack nothing has changed
                    const auto at = [&](std::size_t k) { return normal.dot(left.points[t[k]]) - .03; };
                    return std::min({at(0), at(1), at(2)}) > .6 || std::max({at(0), at(1), at(2)}) < -.6;
                });
                std::vector<Vec3> places;
                while (places.size() < 500) {
                    const auto& t = solid.triangles[random() % solid.triangles.size()];
                    const double u = std::sqrt(share(random)), v = share(random);
                    const Vec3 X =
                        (1 - u) * solid.points[t[0]] + u * (1 - v) * solid.points[t[1]] + u * v * solid.points[t[2]];
                    if (std::abs(normal.dot(X) - .03) < .4) places.push_back(X);
                }
                EXPECT_LT(farthest(places, left.points, skin), solid.triangles.size() > 9000 ? kArc : kRounding)
                    << solid.name << ", normal " << normal.transpose() << ", half width " << half;
                for (const auto& t : takenOf(cut)) {
                    const Vec3 &a = left.points[t[0]], &b = left.points[t[1]], &c = left.points[t[2]];
                    EXPECT_GT((b - a).cross(c - a).dot(a + b + c), -1e-3 * dx * dx);  // the solids are convex round 0
                }
            }
}

}  // namespace
}  // namespace vdbfrac
