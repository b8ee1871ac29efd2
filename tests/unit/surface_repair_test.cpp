// Broken surfaces -> boundaries of solids: each flaw alone, and what the gentlest repair of it is.
#include <vdbfrac/base/error.h>
#include <vdbfrac/repair/surface_repair.h>

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

using namespace vdbfrac;
using namespace vdbfrac::repair;
using tetmesh::PolygonSoup;

namespace {

constexpr double kExact = 1e-12;
// A wrap rounds edges within its offset and closes hollows narrower than alpha.
constexpr double kWrapVolume = 0.05;

/// The unit cube at `at`, as quads that look outward.
PolygonSoup cube(const Vec3& at = Vec3::Zero())
{
    PolygonSoup soup;
    for (int i = 0; i < 8; ++i) soup.points.push_back(at + Vec3(i & 1, i >> 1 & 1, i >> 2));
    soup.polygons = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    return soup;
}

void append(PolygonSoup& soup, const PolygonSoup& other)
{
    const std::size_t first = soup.points.size();
    soup.points.insert(soup.points.end(), other.points.begin(), other.points.end());
    for (auto polygon : other.polygons) {
        for (std::size_t& corner : polygon) corner += first;
        soup.polygons.push_back(std::move(polygon));
    }
}

RepairOptions options()
{
    RepairOptions o;
    o.alpha = 0.1;
    o.offset = 0.02;
    return o;
}

Repaired repaired(const PolygonSoup& soup, const RepairOptions& o = options())
{
    return repairSurface(soup, tetmesh::examine(soup), o, "test");
}

void expectUnitCube(const Repaired& r)
{
    EXPECT_TRUE(r.after.closed);
    EXPECT_EQ(r.after.nonManifoldEdges, 0u);
    EXPECT_EQ(r.after.degenerateFaces, 0u);
    EXPECT_FALSE(r.wrapped);
    EXPECT_NEAR(r.after.volume, 1, kExact);
    EXPECT_NEAR(r.after.area, 6, kExact);
}

TEST(SurfaceRepair, SoundSurfacesAreLeftAsTheyAre)
{
    const Repaired r = repaired(cube());
    expectUnitCube(r);
    EXPECT_EQ(r.joinedPoints + r.removedFaces + r.turnedFaces + r.filledHoles, 0u);
    EXPECT_EQ(r.soup.points.size(), 8u);
}

TEST(SurfaceRepair, TurnedFacesAreTurnedBack)
{
    PolygonSoup soup = cube();
    std::reverse(soup.polygons[3].begin(), soup.polygons[3].end());
    const Repaired r = repaired(soup);
    expectUnitCube(r);
    EXPECT_EQ(r.turnedFaces, 1u);
    for (auto& polygon : soup.polygons) std::reverse(polygon.begin(), polygon.end());
    expectUnitCube(repaired(soup));
}

TEST(SurfaceRepair, LoosePolygonsAreJoined)
{
    PolygonSoup loose;
    for (const auto& polygon : cube().polygons) {
        std::vector<std::size_t> corners;
        for (std::size_t corner : polygon) {
            corners.push_back(loose.points.size());
            loose.points.push_back(cube().points[corner]);
        }
        loose.polygons.push_back(corners);
    }
    const Repaired r = repaired(loose);
    expectUnitCube(r);
    EXPECT_EQ(r.joinedPoints, 16u);
}

TEST(SurfaceRepair, DoubleAndFlatFacesGo)
{
    PolygonSoup soup = cube();
    soup.polygons.push_back(soup.polygons[2]);
    soup.polygons.push_back({0, 1, 1});
    soup.polygons.push_back({0, 1, 0});
    const Repaired r = repaired(soup);
    expectUnitCube(r);
    EXPECT_EQ(r.removedFaces, 3u);
}

TEST(SurfaceRepair, HolesAreFilled)
{
    PolygonSoup soup = cube();
    soup.polygons.pop_back();
    const Repaired r = repaired(soup);
    expectUnitCube(r);
    EXPECT_EQ(r.filledHoles, 1u);
    EXPECT_NEAR(r.widestHole, 1, kExact);
    EXPECT_EQ(r.before.openEdges, 4u);
    RepairOptions never = options();
    never.fillHoles = never.wrapWhenNeeded = false;
    EXPECT_FALSE(repaired(soup, never).after.closed);
}

TEST(SurfaceRepair, SurfacesThatIntersectThemselvesAreWrapped)
{
    PolygonSoup soup = cube();
    append(soup, cube({0.5, 0.25, 0.25}));
    const Repaired r = repaired(soup);
    EXPECT_TRUE(r.intersectsItself);
    EXPECT_TRUE(r.wrapped);
    EXPECT_TRUE(r.after.closed);
    EXPECT_EQ(r.after.nonManifoldEdges, 0u);
    const double united = 2 - 0.5 * 0.75 * 0.75;
    EXPECT_NEAR(r.after.volume - options().offset * r.after.area, united, kWrapVolume * united);
    RepairOptions holesOnly = options();
    holesOnly.wrapWhenNeeded = false;
    EXPECT_FALSE(repaired(soup, holesOnly).wrapped);
}

TEST(SurfaceRepair, WrapsCloseGapsNarrowerThanAlpha)
{
    PolygonSoup soup = cube();
    for (std::size_t i = 0; i < 4; ++i) {  // the top, lifted by a gap
        soup.polygons[1][i] = soup.points.size();
        soup.points.push_back(cube().points[cube().polygons[1][i]] + Vec3(0, 0, 0.03));
    }
    RepairOptions wrap = options();
    wrap.fillHoles = false;
    wrap.wrapAlways = true;
    const Repaired r = repaired(soup, wrap);
    EXPECT_TRUE(r.after.closed);
    EXPECT_NEAR(r.after.volume - wrap.offset * r.after.area, 1.02, kWrapVolume);
}

/// Two pyramids base to base, of n triangles round each tip.
PolygonSoup fans(std::size_t n)
{
    PolygonSoup soup;
    soup.points = {{0, 0, 0.5}, {0, 0, -0.5}};
    for (std::size_t i = 0; i < n; ++i) {
        const double angle = 2 * std::numbers::pi * double(i) / double(n);
        soup.points.emplace_back(std::cos(angle), std::sin(angle), 0);
        const std::size_t next = 2 + (i + 1) % n;
        soup.polygons.push_back({0, 2 + i, next});
        soup.polygons.push_back({1, next, 2 + i});
    }
    return soup;
}

TEST(SurfaceRepair, WorkOnFansIsBounded)
{
    const Repaired few = repaired(fans(300));
    EXPECT_FALSE(few.searchGivenUp);
    EXPECT_GT(few.lookUps, 600u);
    constexpr std::size_t kMany = 30000;
    const Repaired many = repaired(fans(kMany));
    EXPECT_TRUE(many.searchGivenUp);
    EXPECT_LE(many.lookUps, kMaxLookUps + kMaxLookUpsPerFace * 2 * kMany + 1);
    EXPECT_FALSE(many.intersectsItself || many.wrapped);
    EXPECT_TRUE(many.after.closed);
    EXPECT_NEAR(many.after.volume, std::numbers::pi / 3, 1e-6);  // of the cones that the pyramids stand for
}

TEST(SurfaceRepair, WrapsOfFansTakeThePointsThatAWrapResolves)
{
    PolygonSoup cone = fans(30000);  // with a lid of its own that leaves a gap
    std::erase_if(cone.polygons, [](const auto& p) { return p[0] == 1; });
    append(cone, cube({-0.5, -0.5, -1.01}));
    std::vector<std::string> said;
    RepairOptions o = options();
    o.wrapAlways = true;
    o.fillHoles = false;
    o.alpha = 0.3;
    o.say = [&](const std::string& what) { said.push_back(what); };
    const Repaired r = repaired(cone, o);
    EXPECT_TRUE(r.wrapped);
    EXPECT_TRUE(r.after.closed);
    EXPECT_GT(r.after.volume, 1);
    ASSERT_EQ(said.size(), 2u);
    EXPECT_EQ(said[1], "wrapping it");
}

TEST(SurfaceRepair, FacesOfTooManyCornersAreNamed)
{
    PolygonSoup soup = cube();
    soup.polygons[3].resize(kMaxCorners + 1, 2);
    try {
        repaired(soup);
        FAIL();
    } catch (const InputError& e) {
        const std::string said = e.what();
        EXPECT_NE(said.find("face 4 has " + std::to_string(kMaxCorners + 1) + " corners"), std::string::npos) << said;
        EXPECT_NE(said.find("1 to " + std::to_string(kMaxCorners)), std::string::npos) << said;
    }
}

TEST(SurfaceRepair, WhatCannotBeIsNamed)
{
    PolygonSoup nothing = cube();
    nothing.polygons = {{0, 1, 1}, {2, 3, 2}};
    EXPECT_THROW(repaired(nothing), InputError);
    RepairOptions fine = options();
    fine.wrapAlways = true;
    fine.alpha = 1e-6;
    fine.memoryLimit = 1000000000;
    EXPECT_THROW(repaired(cube(), fine), LimitError);
}

TEST(SurfaceRepair, RefusesWhatIsNoSurface)
{
    const auto refused = [](auto change) {
        PolygonSoup soup = cube();
        const tetmesh::SurfaceReport report = tetmesh::examine(soup);
        RepairOptions o = options();
        change(soup, o);
        EXPECT_THROW(repairSurface(soup, report, o, "test"), InputError);
    };
    refused([](PolygonSoup& soup, RepairOptions&) { soup.polygons[3][1] = 8; });
    refused([](PolygonSoup& soup, RepairOptions&) { soup.polygons[3].clear(); });
    for (const double alpha : {-1., 0., std::nan("")})
        refused([&](PolygonSoup&, RepairOptions& o) { o.wrapAlways = true, o.alpha = alpha; });
}

}  // namespace
