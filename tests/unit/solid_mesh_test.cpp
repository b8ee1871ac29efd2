// Solids as one mesh: closed, on their surface, with their edges, the same each time.
#include <vdbfrac/solids/solid_mesh.h>

#include <Eigen/Geometry>

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <vector>

namespace vdbfrac::solids {
namespace {

using tetmesh::RenderMesh;
using enum Primitive::Kind;

Primitive solid(Primitive::Kind kind, const Vec3& center, double radius, double height = 0)
{
    Primitive p;
    p.kind = kind, p.center = center, p.radius = radius, p.height = height, p.tube = 0.25 * radius;
    p.axis = Vec3(.2, 1, -.1).normalized();
    return p;
}

Primitive cube(double size, const Vec3& center = Vec3::Zero())
{
    Primitive p;
    p.size = Vec3::Constant(size), p.center = center;
    return p;
}

int badEdges(const RenderMesh& mesh)
{
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
    for (std::size_t f = 0; f < mesh.faces(); ++f) {
        const auto c = mesh.face(f);
        for (std::size_t k = 0; k < c.size(); ++k) ++sides[{c[k].point, c[(k + 1) % c.size()].point}];
    }
    int bad = 0;
    for (const auto& [edge, n] : sides) bad += n != 1 || !sides.contains({edge.second, edge.first});
    return bad;
}

double volume(const RenderMesh& mesh)
{
    double six = 0;
    for (std::size_t f = 0; f < mesh.faces(); ++f) {
        const auto c = mesh.face(f);
        six += mesh.points[c[0].point].dot(mesh.points[c[1].point].cross(mesh.points[c[2].point]));
    }
    return six / 6;
}

TEST(SolidMesh, OfEachSolidIsClosedAndOnItsSurface)
{
    constexpr double kEdge = .1, kOff = kEdge / 20, kRounding = 1e-9;
    std::vector<Primitive> all = {cube(1.03)};
    for (const auto kind : {sphere, cylinder, capsule, torus}) all.push_back(solid(kind, Vec3(.1, -.2, .3), .6, .8));
    for (const Primitive& p : all) {
        const auto mesh = solidMesh({p, {}, {}}, kEdge);
        ASSERT_TRUE(mesh);
        EXPECT_EQ(badEdges(*mesh), 0) << int(p.kind);
        EXPECT_GT(volume(*mesh), 0);
        for (std::size_t f = 0; f < mesh->faces(); ++f) {
            const auto c = mesh->face(f);
            Vec3 middle = Vec3::Zero();
            for (const auto& corner : c) {
                EXPECT_NEAR(signedDistance(p, mesh->points[corner.point]), 0, kRounding);
                middle += mesh->points[corner.point] / double(c.size());
                const Vec3& normal = mesh->normals[corner.normal];
                EXPECT_GT(signedDistance(p, mesh->points[corner.point] + .01 * normal), .005);
            }
            EXPECT_NEAR(signedDistance(p, middle), 0, kOff) << int(p.kind);
        }
    }
}

TEST(SolidMesh, IsWhatIsUnitedAndTakenAway)
{
    constexpr double kEdge = .05;
    Primitive notch = solid(cylinder, Vec3(.5, 0, 0), .2);
    notch.axis = Vec3::UnitZ();
    Primitive below;
    below.kind = halfspace, below.axis = -Vec3::UnitY(), below.offset = .3;
    const std::vector<Primitive> add = {cube(.4, Vec3(-.5, .2, 0))}, cut = {notch, below};
    const Primitive block = cube(1);
    const auto mesh = solidMesh({block, add, cut}, kEdge);
    ASSERT_TRUE(mesh);
    EXPECT_EQ(badEdges(*mesh), 0);
    const double expected = .8 + .2 * .4 * .4 - std::numbers::pi * .04 / 2;
    EXPECT_NEAR(volume(*mesh), expected, 1e-3);
    // Edges stay sharp: the plane of the cut meets the sides at its corners.
    for (const Vec3& corner : {Vec3(-.5, -.3, -.5), Vec3(.5, -.3, .5), Vec3(.5, .5, .5)})
        EXPECT_TRUE(std::any_of(mesh->points.begin(), mesh->points.end(),
                                [&](const Vec3& p) { return (p - corner).norm() < 1e-12; }));
    // No slivers: each angle is above a degree.
    for (std::size_t f = 0; f < mesh->faces(); ++f) {
        const auto c = mesh->face(f);
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 u = mesh->points[c[(k + 1) % 3].point] - mesh->points[c[k].point],
                       v = mesh->points[c[(k + 2) % 3].point] - mesh->points[c[k].point];
            EXPECT_GT(std::atan2(u.cross(v).norm(), u.dot(v)), std::numbers::pi / 180);
        }
    }
}

TEST(SolidMesh, IsTheSameEachTimeWhateverLiesInMemory)
{
    const Primitive block = cube(1);
    Primitive notch = solid(cylinder, Vec3(.5, 0, 0), .2);
    notch.axis = Vec3::UnitZ();
    // Scores cross each other: many points of their faces lie on one circle, and many faces meet in one point.
    std::vector<Primitive> scores;
    for (const double at : {-.3, 0., .3})
        for (const Vec3& size : {Vec3(.06, .2, 1.2), Vec3(1.2, .2, .06)}) {
            Primitive score = cube(1);
            score.size = size, score.center = Vec3(size.x() < size.z() ? at : 0, .45, size.x() < size.z() ? 0 : at);
            scores.push_back(score);
        }
    std::vector<std::vector<char>> heap;
    for (const std::vector<Primitive>& cut : {std::vector{notch}, scores}) {
        const auto first = solidMesh({block, {}, cut}, .1);
        for (std::size_t k = 1; k < 30; ++k) {
            heap.emplace_back(k * 7919 % 5000 + 1);
            if (k % 3 == 0) heap[k / 2].clear(), heap[k / 2].shrink_to_fit();
            const auto again = solidMesh({block, {}, cut}, .1);
            ASSERT_EQ(again->points, first->points);
            ASSERT_EQ(again->normals, first->normals);
            ASSERT_EQ(again->faceEnd, first->faceEnd);
            for (std::size_t c = 0; c < first->corners.size(); ++c)
                ASSERT_EQ(again->corners[c].point, first->corners[c].point);
        }
    }
}

}  // namespace
}  // namespace vdbfrac::solids
