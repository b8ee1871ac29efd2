// The outer surface cut by cracks: closed, on the surface that was given, and along a smooth rim.
#include "crack_lattice.h"
#include "torn_solids.h"

#include <vdbfrac/skin/opposite.h>
#include <vdbfrac/skin/skin_cut.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace vdbfrac::skin {
namespace {

using namespace test;

TEST(SkinCut, ClosesEveryPartOfATornBody)
{
    for (const double half : {1., .97})
        for (const Solid& solid : {box(half, 1), box(half, 23), ball(half, 7), ball(half, 40)})
            for (const Vec3& normal : kTilts)
                for (const double ends : {1e9, .2}) {
                    const SkinCut cut = cutBy(solid, {normal, .03, ends}, .1);
                    const Drawn d = drawn(solid, cut);
                    EXPECT_EQ(Edges(d).bad(), 0)
                        << solid.name << ", half " << half << ", normal " << normal.transpose() << ", ends " << ends;
                    EXPECT_EQ(cut.defects, 0);
                    EXPECT_GT(cut.torn.size(), 100u);
                }
}

/// Fields are kept in blocks of 8 nodes along an edge; a crack may end in one, beside others that are not there.
TEST(CrackLattice, SeesAllVoxelsRoundANodeAtTheCornerOfABlock)
{
    for (const Coord& node : {Coord{0, 0, 0}, Coord{7, 7, 7}, Coord{8, 3, 0}}) {
        tetmesh::NodeField<float> c({-16, -16, -16}, {16, 16, 16}, -1, -1), now = c;
        c.set(node, .1f);
        const CrackLattice lattice(c, now, .1);
        EXPECT_EQ(lattice.mixedVoxels().size(), 8u);
        for (int k = 0; k < 8; ++k) EXPECT_TRUE(lattice.isMixed(node - tetmesh::cornerOffset(k)));
    }
}

/// A finer mesh that rides on a body has bumps that phi knows nothing of.
TEST(SkinCut, ClosesWhatLiesBesideTheSurfaceOfPhi)
{
    constexpr double dx = .1;
    for (const double voxels : {.2, .4, .7}) {
        Solid solid = ball(1, 40);
        for (Vec3& p : solid.points)
            p *= 1 + voxels * dx * std::sin(23 * p.x()) * std::sin(19 * p.y()) * std::sin(21 * p.z());
        for (const Vec3& normal : kTilts)
            for (int k = 0; k < 8; ++k) {
                const SkinCut cut = cutBy(solid, {normal, .9 - .11 * k, k % 2 == 0 ? 1e9 : .2}, dx);
                EXPECT_EQ(Edges(drawn(solid, cut)).bad(), 0) << voxels << ", " << normal.transpose() << ", " << k;
            }
    }
}

/// Where the surface is no 2-manifold, what is left has no gaps either: by their places, as many faces go along an edge
/// one way as the other.
TEST(SkinCut, ClosesWhatTouchesItselfAlongAnEdge)
{
    for (const int squares : {1, 9})
        for (const Vec3& normal : kTilts) {
            const Solid solid = columns(squares);
            const SkinCut cut = cutBy(solid, {normal, .03}, .1);
            const Drawn d = drawn(solid, cut);
            EXPECT_EQ(cut.defects, 0) << solid.name << ", normal " << normal.transpose();
            EXPECT_GT(cut.torn.size(), 100u);
            using Place = std::array<double, 3>;
            std::map<std::pair<Place, Place>, int> along;
            for (const auto& faces : {d.outside, d.torn})
                for (const auto& t : faces)
                    for (std::size_t k = 0; k < 3; ++k) {
                        const Vec3 &a = d.points[t[k]], &b = d.points[t[(k + 1) % 3]];
                        const Place p{a.x(), a.y(), a.z()}, q{b.x(), b.y(), b.z()};
                        ++along[{p, q}], --along[{q, p}];
                    }
            for (const auto& [edge, sum] : along)
                EXPECT_EQ(sum, 0) << solid.name << ", normal " << normal.transpose() << ", at " << edge.first[0] << ' '
                                  << edge.first[1] << ' ' << edge.first[2];
        }
}

TEST(SkinCut, TakesFromTheBodyWhatTheCrackTakes)
{
    const double dx = .1, r = 1;
    const Solid solid = ball(r, 40);
    const Drawn whole{solid.points, solid.triangles, {}};
    for (const Vec3& normal : kTilts) {
        const Drawn d = drawn(solid, cutBy(solid, {normal, 0}, dx));
        const double gap = volume(whole) - volume(d), slab = std::numbers::pi * 2 * dx * (r * r - dx * dx / 3);
        EXPECT_NEAR(gap / slab, 1, .1) << normal.transpose();  // cut along voxels' tets, smoothed
    }
}

/// What a triangle keeps lies in it and is no more than it.
TEST(SkinCut, PartsOfATriangleLieInIt)
{
    constexpr double kRounding = 1e-9;
    for (const Solid& solid : {box(1, 1), box(.97, 23), ball(1, 30)}) {
        const SkinCut cut = cutBy(solid, {kTilts[1], .03}, .1);
        const Drawn d = drawn(solid, cut);
        std::map<std::uint32_t, double> kept;
        for (const SkinCut::Part& part : cut.parts) {
            const auto& t = solid.triangles[part.triangle];
            const Vec3 u = solid.points[t[1]] - solid.points[t[0]], v = solid.points[t[2]] - solid.points[t[0]];
            const Vec3 normal = u.cross(v).normalized();
            for (std::uint32_t c : part.corner) EXPECT_NEAR(normal.dot(d.points[c] - solid.points[t[0]]), 0, kRounding);
            EXPECT_GE(normal.dot((d.points[part.corner[1]] - d.points[part.corner[0]])
                                     .cross(d.points[part.corner[2]] - d.points[part.corner[0]])),
                      -kRounding);
            kept[part.triangle] += area(d.points, {part.corner});
        }
        EXPECT_GE(kept.size(), 4u) << "triangles that the cut meets";
        for (const auto& [t, sum] : kept) EXPECT_LE(sum, area(solid.points, {solid.triangles[t]}) * (1 + kRounding));
    }
}

TEST(SkinCut, KeepsTheAreaThatTheCrackLeaves)
{
    const double dx = .05;
    const Solid solid = box(1, 1);
    for (const Vec3& normal : {kTilts[0], kTilts[1]}) {
        const Drawn d = drawn(solid, cutBy(solid, {normal, .03}, dx));
        // The crack takes a belt from the four sides: 2 dx high across it, higher along a side that it meets aslant.
        const double belt =
            2 * (2 / std::hypot(normal.y(), normal.x()) + 2 / std::hypot(normal.y(), normal.z())) * (2 * dx) * 1.;
        EXPECT_NEAR(24 - area(d.points, d.outside), belt, .25 * belt) << normal.transpose();
    }
}

TEST(SkinCut, RimsAreSmooth)
{
    for (const int voxels : {20, 40})
        for (const Vec3& normal : kTilts) {
            const double dx = 2. / voxels;
            const Solid solid = ball(1, 60);
            const Drawn d = drawn(solid, cutBy(solid, {normal, .013}, dx));
            const double smooth = 2 * 2 * std::numbers::pi * std::sqrt(1 - dx * dx);
            EXPECT_LE(Edges(d).rim(d) / smooth, voxels == 20 ? 1.3 : 1.15) << normal.transpose();
            EXPECT_GE(Edges(d).rim(d) / smooth, .98);
        }
}

TEST(SkinCut, RimsOfTiltedRodsAreSmooth)
{
    constexpr double kPolygon = 1e-3;  // of 100 sides
    for (const int voxels : {20, 40})
        for (const double jagged : {0., .45})
            for (const Vec3& axis : {kTilts[1], kTilts[2], kTilts[3]}) {
                if (jagged > 0 && axis == kTilts[2]) continue;  // not all lines across it have a node that is torn
                const Solid solid = rod(axis, 100);
                const Lips lips = jagged > 0 ? Lips::closed : Lips::asSimulated;
                const Drawn d = drawn(solid, cutBy(solid, {axis, .013, 1e9, jagged}, 2. / voxels, lips));
                const Edges edges(d);
                EXPECT_EQ(edges.bad(), 0);
                EXPECT_LE(edges.rim(d) / (4 * std::numbers::pi), voxels == 20 ? 1.3 : 1.15) << axis.transpose();
                EXPECT_GE(edges.rim(d) / (4 * std::numbers::pi), 1 - kPolygon) << axis.transpose();
            }
}

/// Of the skin of a solid that is convex round 0: what faces inward [m^2].
double inwardArea(const Drawn& d)
{
    double sum = 0;
    for (const auto& t : d.outside) {
        const Vec3 &a = d.points[t[0]], &b = d.points[t[1]], &c = d.points[t[2]];
        const Vec3 twice = (b - a).cross(c - a);
        if (twice.dot(a + b + c) < 0) sum += .5 * twice.norm();
    }
    return sum;
}

/// Fronts go by voxels, and cracks with them: none of that is seen where lips are closed.
TEST(SkinCut, ClosedLipsOfAJaggedCrackHaveSmoothRims)
{
    constexpr double kRounding = 1e-9, kLost = .004, kFolded = .006;  // of the body, and of its skin
    constexpr double kInward = .01;  // of the square of a voxel, along rims of eighty of them and more
    for (const int voxels : {20, 40})
        for (const Vec3& normal : {kTilts[0], kTilts[1]}) {
            const double dx = 2. / voxels;
            // Eight triangles to a voxel, too, as scanned and sculpted meshes have.
            for (const Solid& solid : {box(1, 1), box(1, 23), box(1, 160), ball(1, 60)}) {
                const bool isBall = solid.points[0].norm() < 1.5;
                const SkinCut cut = cutBy(solid, {normal, .013, 1e9, .45}, dx, Lips::closed);
                const Drawn d = drawn(solid, cut);
                const Edges edges(d);
                EXPECT_EQ(edges.bad(), 0) << solid.name;
                const double y = normal.y();
                const double smooth =
                    isBall ? 4 * std::numbers::pi : 8 * (std::hypot(normal.x(), y) + std::hypot(normal.z(), y)) / y;
                EXPECT_LE(edges.rim(d) / smooth, 1.005) << solid.name << normal.transpose();
                EXPECT_GE(edges.rim(d) / smooth, .995) << solid.name;
                const double whole = volume({solid.points, solid.triangles, {}});
                EXPECT_NEAR(volume(d) / whole, 1, kLost) << solid.name;
                const double skin = area(d.points, d.outside) / area(solid.points, solid.triangles);
                EXPECT_NEAR(skin, 1, kFolded) << solid.name;
                EXPECT_LT(inwardArea(d), kInward * dx * dx) << solid.name;
                for (const SkinCut::Point& p : cut.points)
                    if (p.skin != SkinCut::kNoSkin && !isBall) {
                        EXPECT_NEAR(p.X.cwiseAbs().maxCoeff(), 1, kRounding);
                    }
            }
        }
}

/// How far the nearest `share` of the points of rims that have another lip are from it [voxels].
double apartOf(const Drawn& d, double dx, double share)
{
    std::vector<Vec3> outward(d.points.size(), Vec3::Zero());
    for (const auto& [a, b, c] : d.outside)
        for (const std::uint32_t p : {a, b, c})
            outward[p] += (d.points[b] - d.points[a]).cross(d.points[c] - d.points[a]).stableNormalized();
    std::vector<double> apart;
    for (const Opposite& lip : oppositeRims(d.points, d.torn, outward, dx))
        apart.push_back((lip.at(d.points) - d.points[lip.point]).norm() / dx);
    std::ranges::sort(apart);
    return apart.at(std::size_t(share * double(apart.size())));
}

/// Beside the rim of a crack lie no long triangles with a short side on it, which turn over when the body is strained,
/// and none that are turned over at rest.
TEST(SkinCut, ClosedLipsHaveNoSliversAlongRims)
{
    constexpr double dx = .1, kShort = .15, kOfLongest = .15;  // voxels; of the longest side
    // Rims of one lip do not leave those of the other; at the crack's end they do. Of shares of their points, voxels:
    // .007 and .16 at the most.
    constexpr std::pair<double, double> kApart[] = {{.9, .01}, {.99, .2}};
    constexpr double kLeft = .1;     // of sides of rims: folds in their way. .02 to .09, and .35 to .9 where they stay
    constexpr double kInward = .06;  // square voxels: 0 to .045, and up to .25 where rims turn back on themselves
    for (const Solid& solid : {box(1, 1), box(1, 23), box(1, 160), ball(1, 40)})
        for (const Vec3& normal : kTilts) {
            const SkinCut cut = cutBy(solid, {normal, .013, .2, .45}, dx, Lips::closed, {}, Taken::kept);
            const Drawn d = drawn(solid, cut);
            const Edges edges(d);
            EXPECT_EQ(edges.bad(), 0) << solid.name;
            int sides = 0, slivers = 0;
            for (const auto& t : d.outside) {
                const auto length = [&](std::size_t k) { return (d.points[t[k]] - d.points[t[(k + 1) % 3]]).norm(); };
                const double longest = std::max({length(0), length(1), length(2)});
                for (std::size_t k = 0; k < 3; ++k) {
                    const auto torn = edges.sides.find({t[(k + 1) % 3], t[k]});
                    if (torn == edges.sides.end() || torn->second[1] == 0) continue;
                    ++sides, slivers += length(k) < std::min(kShort * dx, kOfLongest * longest);
                }
            }
            EXPECT_GT(sides, 50) << solid.name;
            EXPECT_LE(slivers, kLeft * sides) << solid.name << ", normal " << normal.transpose();
            if (solid.points.size() > 8) {
                for (const auto& [share, most] : kApart)
                    EXPECT_LT(apartOf(d, dx, share), most) << solid.name << ", normal " << normal.transpose();
                EXPECT_LT(inwardArea(d), kInward * dx * dx) << solid.name << ", normal " << normal.transpose();
            }
            const SkinCut dropped = cutBy(solid, {normal, .013, .2, .45}, dx, Lips::closed);
            EXPECT_EQ(dropped.torn, cut.torn) << "what was taken has a say";
        }
}

/// A rim turns back where its crack ends. Made fair it would shrink from there, and skin that the material has parted
/// under would be drawn whole, from lip to lip.
TEST(SkinCut, ClosedLipsEndWhereTheCrackDoes)
{
    constexpr double dx = .1, kDrawnBack = .5;  // voxels: a quarter, and what each lip goes to meet the other
    const auto endOf = [](const SkinCut& cut) {
        double end = -1e9;
        for (const SkinCut::Point& p : cut.points)
            if (p.skin != SkinCut::kNoSkin) end = std::max(end, p.X.x());
        return end;
    };
    for (const Solid& solid : {box(1, 1), box(1, 23), ball(1, 40)})
        for (const double half : {.3, 1.}) {
            const Plane plane{kTilts[1], .013, .2, 0, half};
            EXPECT_GT(endOf(cutBy(solid, plane, dx, Lips::closed)), endOf(cutBy(solid, plane, dx)) - kDrawnBack * dx)
                << solid.name << ", half " << half;
        }
}

/// Area of the torn faces that look against those round one of their corners, over that of all.
double foldedShare(const Drawn& d)
{
    std::vector<Vec3> round(d.points.size(), Vec3::Zero());
    const auto areaOf = [&](const auto& t) {
        return (d.points[t[1]] - d.points[t[0]]).cross(d.points[t[2]] - d.points[t[0]]);
    };
    for (const auto& t : d.torn)
        for (const std::uint32_t p : t) round[p] += areaOf(t);
    double folded = 0, all = 0;
    for (const auto& t : d.torn) {
        const Vec3 own = areaOf(t);
        all += own.norm();
        if (std::any_of(t.begin(), t.end(), [&](std::uint32_t p) { return own.dot(round[p]) < 0; }))
            folded += own.norm();
    }
    return folded / all;
}

/// A crack just below a face leaves a thin flap: its torn faces neither come through it nor fold over.
TEST(SkinCut, ClosedLipsStayBelowTheSkin)
{
    constexpr double kRounding = 1e-9, dx = .1, kDeep = .1 * dx;
    for (const Solid& solid : {box(1, 1), box(1, 40)})
        for (const double offset : {.013, .75, .85}) {
            const Plane plane{kTilts[1], offset, 1e9, .45};
            const SkinCut open = cutBy(solid, plane, dx), closed = cutBy(solid, plane, dx, Lips::closed);
            ASSERT_LE(open.points.size(), closed.points.size());  // corners of the skin that rims pass over are behind
            std::size_t thin = 0;
            for (std::size_t i = 0; i < open.points.size(); ++i) {
                if (open.points[i].skin != SkinCut::kNoSkin) continue;
                const double before = -solid.phi(open.points[i].X), after = -solid.phi(closed.points[i].X);
                thin += before < kDeep;
                EXPECT_GE(after, std::min(before, kDeep) - kRounding) << offset;
            }
            EXPECT_GT(thin, 0u);
            const Drawn d = drawn(solid, closed);
            EXPECT_EQ(Edges(d).bad(), 0);
            EXPECT_LE(foldedShare(d), .002) << solid.name << ' ' << offset;
        }
}

TEST(SkinCut, DetailRoughensTornFacesAlikeOnBothLipsAndLeavesRims)
{
    const double dx = .1;
    const Solid solid = ball(1, 40);
    const TornDetail detail{.05, .3, 7};
    const SkinCut smooth = cutBy(solid, {kTilts[0], .03}, dx, Lips::closed);
    const SkinCut rough = cutBy(solid, {kTilts[0], .03}, dx, Lips::closed, detail);
    ASSERT_EQ(smooth.points.size(), rough.points.size());
    struct Lip {
        Vec3 X, moved;
        bool isUpper;
    };
    double sum = 0;
    std::vector<Lip> lips;
    std::size_t most = 0;  // that moved farthest
    for (std::size_t i = 0; i < rough.points.size(); ++i) {
        const auto& point = smooth.points[i];
        const Vec3 moved = rough.points[i].X - point.X;
        if (point.skin != SkinCut::kNoSkin) {
            EXPECT_EQ(moved, Vec3(Vec3::Zero()));
            continue;
        }
        EXPECT_LE(moved.cwiseAbs().maxCoeff(), 1.75 * detail.amplitude);  // 1 + 1/2 + 1/4
        sum += moved.squaredNorm();
        if (moved.norm() > (rough.points[most].X - smooth.points[most].X).norm()) most = i;
        lips.push_back({point.X, moved, kTilts[0].dot(dx * point.anchor.toVec()) > .03});
    }
    EXPECT_GT(std::sqrt(sum / double(lips.size())), .3 * detail.amplitude);
    // Lips are cut apart, so points of one are near some of the other, and the noise changes little on the way.
    constexpr double kSlope = 20;  // 1/m, over the amplitude: of three octaves
    std::size_t pairs = 0;
    for (std::size_t i = 0; i < lips.size(); i += 37)
        for (const Lip& other : lips) {
            const double apart = (other.X - lips[i].X).norm();
            if (other.isUpper == lips[i].isUpper || apart > .02) continue;
            EXPECT_LE((other.moved - lips[i].moved).norm(), kSlope * apart * detail.amplitude);
            ++pairs;
        }
    EXPECT_GT(pairs, 20u);
    EXPECT_NE(cutBy(solid, {kTilts[0], .03}, dx, Lips::closed, {.05, .3, 8}).points[most].X, rough.points[most].X);
}

TEST(SkinCut, LeavesWhatDidNotTear)
{
    const Solid solid = box(1, 10);
    const auto rest = fieldOf(solid.phi, solid.reach, .1);
    const SkinCut cut = SkinCutter(solid.points, solid.triangles, rest, .1).cut(rest, rest, {});
    EXPECT_TRUE(cut.points.empty());
    EXPECT_TRUE(cut.torn.empty());
    EXPECT_EQ(std::count(cut.fate.begin(), cut.fate.end(), SkinCut::Fate::kept), std::ptrdiff_t(cut.fate.size()));
}

}  // namespace
}  // namespace vdbfrac::skin
