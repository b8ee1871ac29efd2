// Colliders in the pictures of a run.
#include "drawn_colliders.h"

#include <vdbfrac/scene/scene.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

using namespace vdbfrac;
using namespace vdbfrac::cli;

namespace {

scene::Collider collider(const Primitive& solid, const scene::Path& path = scene::Velocity{})
{
    scene::Collider c;
    c.shape = solid;
    c.move = path;
    return c;
}

Primitive level(double height)
{
    Primitive p;
    p.kind = Primitive::Kind::halfspace;
    p.axis = -Vec3::UnitY();
    p.offset = -height;
    return p;
}

pictures::Subject triangle()
{
    pictures::Subject s;
    s.points = {Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY()};
    s.triangles = {{0, 1, 2}};
    s.normals.resize(1, {Vec3::UnitZ(), Vec3::UnitZ(), Vec3::UnitZ()});
    s.colour.resize(1);
    return s;
}

}  // namespace

TEST(DrawnColliders, AreWhereTheirPathsTakeThem)
{
    Primitive ball;
    ball.kind = Primitive::Kind::sphere;
    ball.radius = .5;
    ball.center = {1, 0, 0};
    scene::Scene scene;
    scene.grid.voxelSize = .1;
    scene.colliders = {collider(ball, scene::Velocity{{0, 2, 0}})};
    const DrawnColliders drawn(scene);
    EXPECT_FALSE(drawn.floor());
    pictures::Subject subject = triangle();
    drawn.addTo(subject, 1.5, {0, 0, 1});
    ASSERT_GT(subject.points.size(), 50u);
    for (std::size_t i = 3; i < subject.points.size(); ++i)
        EXPECT_NEAR((subject.points[i] - Vec3(1, 3, -1)).norm(), .5, .01);
    EXPECT_EQ(subject.triangles.size(), subject.normals.size());
    EXPECT_EQ(subject.triangles.size(), subject.colour.size());
}

TEST(DrawnColliders, ALevelOneThatStandsStillIsTheFloor)
{
    scene::Scene scene;
    scene.grid.voxelSize = .1;
    scene.colliders = {collider(level(-.3)), collider(level(-.2))};
    pictures::Subject subject = triangle();
    const DrawnColliders still(scene);
    EXPECT_EQ(still.floor(), -.2);
    still.addTo(subject, 0, Vec3::Zero());
    EXPECT_EQ(subject.triangles.size(), 1u);
    // One that moves, even if it comes back, is a square, seen from where it does not reach.
    const scene::PoseKey up{.time = 1, .translate = Vec3::UnitY()}, back{.time = 2};
    scene.colliders = {collider(level(-.3), scene::Keys{{{}, up, back}})};
    const DrawnColliders moves(scene);
    EXPECT_FALSE(moves.floor());
    moves.addTo(subject, 1, Vec3::Zero());
    EXPECT_EQ(subject.triangles.size(), 1u);
    ASSERT_EQ(subject.backdrops.size(), 1u);
    const auto& [center, toSide, toTop, colour] = subject.backdrops[0];
    EXPECT_NEAR(center.y(), .7, 1e-12);
    EXPECT_NEAR((toSide.cross(toTop).normalized() - Vec3::UnitY()).norm(), 0, 1e-12);
    EXPECT_GT(std::min(toSide.norm(), toTop.norm()), 1);
}

/// Of whatever size they are to the voxels.
TEST(DrawnColliders, HaveAsManyTrianglesOnAnyGrid)
{
    Primitive table;
    table.size = {20, 1, 20};
    for (const auto kind : {Primitive::Kind::box, Primitive::Kind::sphere, Primitive::Kind::cylinder,
                            Primitive::Kind::capsule, Primitive::Kind::torus}) {
        table.kind = kind, table.radius = 1, table.height = 20, table.tube = .2;
        std::vector<std::size_t> triangles;
        for (const double dx : {1., .001}) {
            scene::Scene scene;
            scene.grid.voxelSize = dx;
            scene.colliders = {collider(table)};
            pictures::Subject subject = triangle();
            DrawnColliders(scene).addTo(subject, 0, Vec3::Zero());
            triangles.push_back(subject.triangles.size());
        }
        EXPECT_EQ(triangles[0], triangles[1]);
        EXPECT_LT(triangles[0], kind == Primitive::Kind::box ? 20u : 100000u);
    }
}
