// Holes that cracks leave in the outer surface at rest.
#include "torn_solids.h"

#include <vdbfrac/skin/holes.h>

#include <gtest/gtest.h>

namespace vdbfrac::skin {
namespace {

using namespace test;

Triangles coverOf(const Hole& hole)
{
    Triangles triangles;
    for (const auto& t : hole.cover) triangles.push_back({hole.rim[t[0]], hole.rim[t[1]], hole.rim[t[2]]});
    return triangles;
}

/// The two ends of a ball that a crack has cut through are holes, if no lip lies on another: their covers close what is
/// left of the skin. Where lips lie on each other on one side, the strip between them on the other is a hole; part of
/// one rim alone comes round nowhere, and has no cover.
TEST(SkinHoles, AreCovered)
{
    constexpr double dx = .1;
    const Solid solid = ball(1, 40);
    for (const Vec3& normal : kTilts) {
        const Drawn d = drawn(solid, cutBy(solid, {normal, .23}, dx));
        tetmesh::DrawnTopology topology;
        topology.mesh.points = d.points;
        for (const auto* faces : {&d.outside, &d.torn})
            for (const auto& t : *faces) {
                const tetmesh::RenderMesh::Corner corners[3] = {{t[0]}, {t[1]}, {t[2]}};
                topology.mesh.addFace(corners, tetmesh::RenderMesh::kNone, tetmesh::RenderMesh::kNone);
                topology.torn.push_back(faces == &d.torn);
            }
        std::vector<std::uint8_t> isJoined(d.points.size(), 0);
        const std::vector<Hole> holes = holesOf(topology, isJoined, dx);
        ASSERT_EQ(holes.size(), 2u);
        Drawn closed{d.points, d.outside, {}};
        for (const Hole& hole : holes)
            for (const auto& t : coverOf(hole)) closed.torn.push_back(t);
        const Edges edges(closed);  // covers may have some of the skin's edges too, as their points are others
        for (const auto& [edge, n] : edges.sides) {
            const auto back = edges.sides.find({edge.second, edge.first});
            ASSERT_TRUE(back != edges.sides.end() && n[0] + n[1] == back->second[0] + back->second[1]);
        }
        EXPECT_NEAR(volume(closed), volume(d), .01 * volume(d));
        const Vec3 aside = normal.unitOrthogonal();
        for (std::size_t p = 0; p < isJoined.size(); ++p) isJoined[p] = aside.dot(d.points[p]) > 0;
        const std::vector<Hole> strips = holesOf(topology, isJoined, dx);
        ASSERT_EQ(strips.size(), 1u);
        const double lost = area(solid.points, solid.triangles) - area(d.points, d.outside);
        EXPECT_NEAR(area(d.points, coverOf(strips[0])), .5 * lost, .1 * lost);  // flat where the ball is round
        for (std::size_t p = 0; p < isJoined.size(); ++p)
            isJoined[p] = aside.dot(d.points[p]) > 0 || normal.dot(d.points[p]) > .23;
        const std::vector<Hole> halves = holesOf(topology, isJoined, dx);
        ASSERT_EQ(halves.size(), 1u);
        EXPECT_TRUE(halves[0].cover.empty());
        isJoined.assign(isJoined.size(), 1);
        EXPECT_EQ(holesOf(topology, isJoined, dx).size(), 0u);
    }
}

}  // namespace
}  // namespace vdbfrac::skin
