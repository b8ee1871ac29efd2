// Small pieces of what a cut leaves: crumbs that are material, and specks that are none.
#include "torn_solids.h"

#include <vdbfrac/base/disjoint_sets.h>
#include <vdbfrac/skin/skin_cut.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

namespace vdbfrac::skin {
namespace {

using namespace test;

/// Points of each piece that is drawn.
std::map<std::uint32_t, std::vector<std::uint32_t>> piecesOf(const Drawn& d)
{
    DisjointSets sets(d.points.size());
    std::set<std::uint32_t> used;
    for (const auto* faces : {&d.outside, &d.torn})
        for (const auto& t : *faces) sets.join(t[0], t[1]), sets.join(t[0], t[2]), used.insert(t.begin(), t.end());
    std::map<std::uint32_t, std::vector<std::uint32_t>> pieces;
    for (const std::uint32_t p : used) pieces[sets.find(p)].push_back(p);
    return pieces;
}

/// Of what a crack cuts off; all that is left has material or is larger than a voxel.
std::int64_t specksOf(const Solid& solid, const Plane& plane, double dx)
{
    const SkinCut cut = cutBy(solid, plane, dx);
    const Drawn d = drawn(solid, cut);
    EXPECT_EQ(Edges(d).bad(), 0);
    for (const auto& [first, points] : piecesOf(d)) {
        Eigen::AlignedBox3d box;
        bool hasMaterial = false;
        for (const std::uint32_t p : points) {
            box.extend(d.points[p]);
            if (p < solid.points.size()) continue;
            const Vec3 node = dx * cut.points[p - solid.points.size()].anchor.toVec();
            hasMaterial = hasMaterial || std::max(solid.phi(node), plane.c(node, dx)) < 0;
        }
        EXPECT_TRUE(hasMaterial || box.sizes().maxCoeff() >= dx) << solid.name << ", offset " << plane.offset;
    }
    return cut.specks;
}

/// A crack cuts off what a skin bulges out from between its nodes. What has no material is not drawn, as it would hang
/// in the air.
TEST(SkinCut, LeavesNoSpecksWithoutMaterial)
{
    constexpr double dx = .1;
    std::int64_t specks = 0;
    for (const Solid& solid : {ball(1, 12), rod(Vec3(.3, .2, 1).normalized(), 24), box(.97, 7)})
        for (const Vec3& normal : kTilts)
            for (int k = 0; k < 10; ++k) specks += specksOf(solid, {normal, .9 - .02 * k}, dx);
    EXPECT_GT(specks, 0);
    Solid fine = ball(1, 80);  // specks are tips of bumps that phi knows nothing of, and have triangles that are whole
    for (Vec3& p : fine.points) p *= 1 + .7 * dx * std::sin(23 * p.x()) * std::sin(19 * p.y()) * std::sin(21 * p.z());
    std::int64_t ofFine = 0;
    for (const Vec3& normal : kTilts)
        for (const double offset : {.88, .86}) {
            const std::int64_t own = specksOf(fine, {normal, offset}, dx);
            ofFine += own;
            // Each is counted once, whatever closing lips does to the rest.
            EXPECT_LE(cutBy(fine, {normal, offset}, dx, Lips::closed).specks, own + 1);
        }
    EXPECT_GT(ofFine, 0);
}

/// A crack round one voxel node, inside and at the skin, leaves a crumb. With closed lips it takes its part of the gap,
/// so it is drawn no smaller than it is; the even surfaces of larger pieces would be a point for it.
TEST(SkinCut, ClosedLipsLeaveCrumbsTheirSize)
{
    constexpr double dx = .1;
    const Solid solid = box(.97, 40);
    for (const Coord& at : {Coord{0, 0, 0}, Coord{2, 9, 3}, Coord{9, 9, 9}}) {
        const auto rest = fieldOf(solid.phi, solid.reach, dx);
        auto now = rest;
        for (int k = 0; k < 27; ++k) {
            const Coord n = at + Coord{k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1};
            if (rest(n) < 0) now.set(n, float((n == at ? -.3 : .5) * dx));
        }
        const auto crumb = [&](Lips lips) {
            const SkinCut cut = SkinCutter(solid.points, solid.triangles, rest, dx).cut(rest, now, {lips, {}});
            const Drawn d = drawn(solid, cut);
            EXPECT_EQ(Edges(d).bad(), 0);
            EXPECT_EQ(cut.specks, 0);
            double least = 1e300;
            for (const auto& [first, points] : piecesOf(d)) {
                const auto isOwn = [&](const auto& t) { return std::ranges::binary_search(points, t[0]); };
                Drawn piece{d.points, {}, {}};
                std::ranges::copy_if(d.outside, std::back_inserter(piece.outside), isOwn);
                std::ranges::copy_if(d.torn, std::back_inserter(piece.torn), isOwn);
                if (const double v = volume(piece); v > 0) least = std::min(least, v);
            }
            return least / (dx * dx * dx);
        };
        const double simulated = crumb(Lips::asSimulated);
        EXPECT_GT(simulated, .02);
        EXPECT_LT(simulated, 4);
        EXPECT_GT(crumb(Lips::closed), simulated) << at.x;
        EXPECT_LT(crumb(Lips::closed), 27) << at.x;
    }
}

/// What is left of a crack one to three nodes long inside, once its lips are closed, is nothing.
TEST(SkinCut, ClosedLipsLeaveNoHollowWithoutSize)
{
    constexpr double dx = .1;
    const Solid solid = box(.97, 7);
    const auto rest = fieldOf(solid.phi, solid.reach, dx);
    auto now = rest;
    for (const Coord node : {Coord{2, 1, 3}, Coord{3, 1, 3}, Coord{4, 1, 3}}) {
        now.set(node, float(.3 * dx));
        for (const Lips lips : {Lips::asSimulated, Lips::closed}) {
            const SkinCut cut = SkinCutter(solid.points, solid.triangles, rest, dx).cut(rest, now, {lips, {}});
            EXPECT_EQ(cut.torn.empty(), lips == Lips::closed);
            EXPECT_EQ(cut.specks, lips == Lips::closed ? 1 : 0);
        }
    }
}

}  // namespace
}  // namespace vdbfrac::skin
