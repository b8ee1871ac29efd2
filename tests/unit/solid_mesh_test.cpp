// Solids as one mesh: closed, on their surface, with their edges, the same each time.
#include <vdbfrac/solids/solid_mesh.h>

#include <Eigen/Geometry>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>
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
        for (std::size_t k = 2; k < c.size(); ++k)
            six += mesh.points[c[0].point].dot(mesh.points[c[k - 1].point].cross(mesh.points[c[k].point]));
    }
    return six / 6;
}

TEST(SolidMesh, OfEachSolidIsClosedAndOnItsSurface)
{
    constexpr double kEdge = .1, kOff = kEdge / 20, kRounding = 1e-9;
    std::vector<Primitive> all = {cube(1.03), cube(.9, Vec3(.1, 0, 0))};
    all[1].rotate = Vec3(20, -35, 70);
    for (const auto kind : {sphere, cylinder, capsule, torus}) all.push_back(solid(kind, Vec3(.1, -.2, .3), .6, .8));
    for (const Primitive& p : all) {
        const auto mesh = solidMesh(p, {}, kEdge);
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

/// A capsule that lies in the top of a box meets it at a shallow angle: flat faces stay flat up to that edge.
TEST(SolidMesh, SolidsMeetInEdgesAtAnyAngle)
{
    constexpr double kFlat = 1e-6;  // normals are of triangles whose points are rounded
    Primitive box = cube(1), rod = solid(capsule, Vec3(0, .1, 0), .5, .6);
    rod.axis = Vec3::UnitX();
    const std::vector<Primitive> rods = {rod};
    const auto mesh = solidMesh(box, {rods, {}}, .1);
    ASSERT_TRUE(mesh);
    int onTop = 0;
    for (std::size_t f = 0; f < mesh->faces(); ++f) {
        const auto c = mesh->face(f);
        if (std::ranges::any_of(c, [&](const auto& k) { return std::abs(mesh->points[k.point].y() - .5) > 1e-9; }))
            continue;
        ++onTop;
        for (const auto& corner : c) EXPECT_GT(mesh->normals[corner.normal].y(), 1 - kFlat);
    }
    EXPECT_GT(onTop, 50);
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
    const auto mesh = solidMesh(block, {add, cut}, kEdge);
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

/// Scored down to its middle on both ways: corefinement leaves points in one place there, and folds.
std::pair<Primitive, std::vector<Primitive>> scoredSlab()
{
    Primitive slab = cube(1);
    slab.size = Vec3(.24, .04, .16), slab.center = Vec3(0, .2, 0);
    std::vector<Primitive> scores;
    for (int i = 0; i < 8; ++i) {
        const double at = .04 * (i < 3 ? i - 1 : i - 5);
        Primitive score = cube(1);
        score.size = i < 3 ? Vec3(.3, .04, .01) : Vec3(.01, .04, .3);
        score.center = i < 3 ? Vec3(0, .21, at) : Vec3(at, .21, 0);
        scores.push_back(score);
    }
    return {slab, scores};
}

TEST(SolidMesh, HasNoFoldsWhereScoresCross)
{
    const auto [slab, scores] = scoredSlab();
    for (const double edge : {.01, .008, .005}) {
        const auto mesh = solidMesh(slab, {{}, scores}, edge);
        ASSERT_TRUE(mesh);
        EXPECT_EQ(badEdges(*mesh), 0) << edge;
        std::vector<std::array<double, 9>> places;  // of corners, from the least on
        for (std::size_t f = 0; f < mesh->faces(); ++f) {
            std::array<std::array<double, 3>, 3> t;
            for (std::size_t k = 0; k < 3; ++k) Vec3::Map(t[k].data()) = mesh->points[mesh->face(f)[k].point];
            std::sort(t.begin(), t.end());
            places.emplace_back();
            for (std::size_t k = 0; k < 9; ++k) places.back()[k] = t[k / 3][k % 3];
        }
        std::sort(places.begin(), places.end());
        EXPECT_EQ(std::adjacent_find(places.begin(), places.end()), places.end()) << edge;
        // Scores .03 deep of .04: three across of .24, five of .16, that share fifteen squares.
        EXPECT_NEAR(volume(*mesh), .24 * .04 * .16 - .03 * (3 * .24 * .01 + 5 * .16 * .01 - 15 * 1e-4), 1e-9) << edge;
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
    const auto [slab, flush] = scoredSlab();
    std::vector<std::vector<char>> heap;
    using Case = std::tuple<Primitive, std::vector<Primitive>, double>;
    for (const auto& [solid, cut, edge] : {Case{block, {notch}, .1}, {block, scores, .1}, {slab, flush, .01}}) {
        const auto first = solidMesh(solid, {{}, cut}, edge);
        for (std::size_t k = 1; k < 30; ++k) {
            heap.emplace_back(k * 7919 % 5000 + 1);
            if (k % 3 == 0) heap[k / 2].clear(), heap[k / 2].shrink_to_fit();
            const auto again = solidMesh(solid, {{}, cut}, edge);
            ASSERT_EQ(again->points, first->points);
            ASSERT_EQ(again->normals, first->normals);
            ASSERT_EQ(again->faceEnd, first->faceEnd);
            for (std::size_t c = 0; c < first->corners.size(); ++c)
                ASSERT_EQ(again->corners[c].point, first->corners[c].point);
        }
    }
}

/// A cube of n x n squares a side, each side with points, a group and texture coordinates of its own.
RenderMesh boxOfSides(double half, int n)
{
    RenderMesh mesh;
    mesh.materials = {"wood", "paint"};
    for (int side = 0; side < 6; ++side) {
        mesh.groups.push_back("side " + std::to_string(side));
        const int axis = side / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        const bool isUpper = side % 2 == 1;
        const std::uint32_t first = std::uint32_t(mesh.points.size());
        for (int j = 0; j <= n; ++j)
            for (int i = 0; i <= n; ++i) {
                Vec3 X;
                X[axis] = isUpper ? half : -half, X[u] = half * (2. * i / n - 1), X[v] = half * (2. * j / n - 1);
                mesh.points.push_back(X);
                mesh.uvs.emplace_back(X[u] + side, 2 * X[v], 0);
            }
        mesh.normals.push_back((isUpper ? 1. : -1.) * Vec3::Unit(axis));
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) {
                const std::uint32_t a = first + std::uint32_t(j * (n + 1) + i), b = a + 1, d = a + std::uint32_t(n + 1),
                                    c = d + 1, m = std::uint32_t(side);
                std::array<RenderMesh::Corner, 4> square{{{a, a, m}, {b, b, m}, {c, c, m}, {d, d, m}}};
                if (!isUpper) std::swap(square[1], square[3]);
                mesh.addFace(square, m, m % 2);
            }
    }
    return mesh;
}

double areaOf(const RenderMesh& mesh, std::size_t f)
{
    const auto c = mesh.face(f);
    Vec3 sum = Vec3::Zero();
    for (std::size_t k = 2; k < c.size(); ++k)
        sum += .5 * (mesh.points[c[k - 1].point] - mesh.points[c[0].point])
                        .cross(mesh.points[c[k].point] - mesh.points[c[0].point]);
    return sum.norm();
}

/// Equal points as one.
RenderMesh joined(RenderMesh mesh)
{
    std::map<std::array<double, 3>, std::uint32_t> number;
    for (RenderMesh::Corner& c : mesh.corners) {
        const Vec3& X = mesh.points[c.point];
        c.point = number.emplace(std::array{X.x(), X.y(), X.z()}, c.point).first->second;
    }
    return mesh;
}

/// A score across the upper side and a bump on another: all other faces are as they were, what is left of faces has
/// their texture coordinates, and solids bring their own faces.
TEST(CarvedMesh, KeepsWhatFacesCarry)
{
    constexpr double kRounding = 1e-8, kEdge = .1, kHalf = .5;
    constexpr int kSquares = 7;
    const RenderMesh whole = boxOfSides(kHalf, kSquares);
    Primitive score = cube(1);
    score.size = Vec3(.1, .2, 2), score.center = Vec3(.03, kHalf, 0);
    const std::vector<Primitive> cut = {score}, add = {solid(sphere, Vec3(kHalf, 0, 0), .2)};
    const auto mesh = carvedMesh(whole, {add, cut}, kEdge);
    ASSERT_TRUE(mesh);
    EXPECT_EQ(badEdges(joined(*mesh)), 0);
    EXPECT_NEAR(volume(*mesh), 1 - .1 * .1 + 2. / 3 * std::numbers::pi * .008, 1e-3);
    EXPECT_TRUE(std::equal(whole.points.begin(), whole.points.end(), mesh->points.begin()));
    std::vector<double> area(6, 0), taken{0, 0, 0, .1, .01, .01};
    taken[1] = std::numbers::pi * .04;
    std::size_t squares = 0, made = 0;
    for (std::size_t f = 0; f < mesh->faces(); ++f) {
        const auto corners = mesh->face(f);
        squares += corners.size() == 4;
        if (mesh->group[f] == RenderMesh::kNone) {
            ++made;
            EXPECT_EQ(mesh->material[f], RenderMesh::kNone);
            for (const auto& c : corners) {
                EXPECT_EQ(c.uv, RenderMesh::kNone);
                EXPECT_NEAR(mesh->normals[c.normal].norm(), 1, kRounding);
            }
            continue;
        }
        const int side = int(mesh->group[f]), axis = side / 2;
        area[std::size_t(side)] += areaOf(*mesh, f);
        EXPECT_EQ(mesh->material[f], mesh->group[f] % 2);
        for (const auto& c : corners) {
            const Vec3& X = mesh->points[c.point];
            EXPECT_NEAR(X[axis], side % 2 == 1 ? kHalf : -kHalf, kRounding);
            EXPECT_NEAR(mesh->uvs[c.uv].x(), X[(axis + 1) % 3] + side, kRounding);
            EXPECT_NEAR(mesh->uvs[c.uv].y(), 2 * X[(axis + 2) % 3], kRounding);
            EXPECT_NEAR(std::abs(mesh->normals[c.normal][axis]), 1, kRounding);
        }
    }
    for (std::size_t side = 0; side < 6; ++side)
        EXPECT_NEAR(area[side], 1 - taken[side], side == 1 ? 7e-3 : kRounding) << side;
    // The score meets two rows of squares of the upper side and two squares each at its ends, the ball 3 x 3.
    EXPECT_EQ(squares, 6u * kSquares * kSquares - 2 * kSquares - 2 * 2 - 9);
    EXPECT_GT(made, 50u);
    const auto again = carvedMesh(whole, {add, cut}, kEdge);
    EXPECT_EQ(again->points, mesh->points);
    EXPECT_EQ(again->uvs, mesh->uvs);
    EXPECT_EQ(again->faceEnd, mesh->faceEnd);
}

TEST(CarvedMesh, IsNoneWhereTheMeshHasNoInside)
{
    Primitive score = cube(1);
    score.size = Vec3(.1, .2, 2), score.center = Vec3(.03, .5, 0);
    const std::vector<Primitive> cut = {score};
    RenderMesh open = boxOfSides(.5, 3);
    open.corners.resize(open.corners.size() - 4), open.faceEnd.pop_back();
    EXPECT_FALSE(carvedMesh(open, {{}, cut}, .1));
    RenderMesh inverted = boxOfSides(.5, 3);
    for (std::size_t f = 0; f < inverted.faces(); ++f) std::swap(inverted.corners[4 * f], inverted.corners[4 * f + 2]);
    EXPECT_FALSE(carvedMesh(inverted, {{}, cut}, .1));
    EXPECT_FALSE(carvedMesh({}, {{}, cut}, .1));
}

/// A second mesh behind the first, moved.
RenderMesh with(RenderMesh mesh, const RenderMesh& other, const Vec3& by)
{
    const auto points = std::uint32_t(mesh.points.size()), uvs = std::uint32_t(mesh.uvs.size()),
               normals = std::uint32_t(mesh.normals.size());
    for (const Vec3& X : other.points) mesh.points.push_back(X + by);
    mesh.uvs.insert(mesh.uvs.end(), other.uvs.begin(), other.uvs.end());
    mesh.normals.insert(mesh.normals.end(), other.normals.begin(), other.normals.end());
    for (std::size_t f = 0; f < other.faces(); ++f) {
        std::vector<RenderMesh::Corner> face(other.face(f).begin(), other.face(f).end());
        for (auto& c : face) c.point += points, c.uv += uvs, c.normal += normals;
        mesh.addFace(face, other.group[f], other.material[f]);
    }
    return mesh;
}

/// Two boxes that reach into each other, in general position, and a third apart from them.
TEST(UnitedMesh, IsOneSurfaceThatKeepsWhatFacesCarry)
{
    constexpr double kRounding = 1e-8;
    const Vec3 by(.31, .23, .17), away(5, 0, 0);
    const RenderMesh one = boxOfSides(.5, 3);
    const RenderMesh whole = with(with(one, one, by), one, away);
    const UnitedMesh united = unitedMesh(whole, .1);
    EXPECT_EQ(united.shells, 2u);
    ASSERT_TRUE(united.mesh);
    EXPECT_EQ(badEdges(joined(*united.mesh)), 0);
    EXPECT_NEAR(volume(*united.mesh), 3 - (1 - by.x()) * (1 - by.y()) * (1 - by.z()), kRounding);
    std::size_t squares = 0;
    for (std::size_t f = 0; f < united.mesh->faces(); ++f) {
        const int side = int(united.mesh->group[f]), axis = side / 2;
        squares += united.mesh->face(f).size() == 4;
        for (const auto& c : united.mesh->face(f)) {
            const Vec3& X = united.mesh->points[c.point];
            const bool isSecond = std::abs(std::abs(X[axis] - by[axis]) - .5) < kRounding;
            const Vec3 own = X.x() > 3 ? Vec3(X - away) : isSecond ? Vec3(X - by) : X;
            EXPECT_NEAR(own[axis], side % 2 == 1 ? .5 : -.5, kRounding);
            EXPECT_NEAR(united.mesh->uvs[c.uv].x(), own[(axis + 1) % 3] + side, kRounding);
            EXPECT_NEAR(std::abs(united.mesh->normals[c.normal][axis]), 1, kRounding);
        }
    }
    EXPECT_GT(squares, 2u * 54 - 36);  // of all three, but for those of two corners
}

TEST(UnitedMesh, IsWithoutWhatLiesInside)
{
    RenderMesh small = boxOfSides(.2, 2);
    const UnitedMesh united = unitedMesh(with(boxOfSides(.5, 3), small, Vec3(.1, 0, 0)), .1);
    EXPECT_EQ(united.shells, 2u);
    ASSERT_TRUE(united.mesh);
    EXPECT_EQ(united.mesh->faces(), 54u);
    EXPECT_NEAR(volume(*united.mesh), 1, 1e-12);
}

TEST(UnitedMesh, IsNoneWhereNothingMeetsOrNothingIsEnclosed)
{
    const RenderMesh one = boxOfSides(.5, 3);
    EXPECT_EQ(unitedMesh(one, .1).shells, 0u);
    EXPECT_EQ(unitedMesh(with(one, one, Vec3(1.01, .3, 0)), .1).shells, 0u);
    // The boxes round two thin plates meet, these do not.
    RenderMesh plate = one;
    for (Vec3& X : plate.points) X = Vec3(X.x(), .1 * X.y() + X.x(), X.z());
    EXPECT_EQ(unitedMesh(with(plate, plate, Vec3(0, .3, 0)), .1).shells, 0u);
    RenderMesh open = with(one, one, Vec3(.31, .23, .17));
    open.corners.resize(open.corners.size() - 4), open.faceEnd.pop_back();
    EXPECT_EQ(unitedMesh(open, .1).shells, 0u);
    EXPECT_EQ(unitedMesh({}, .1).shells, 0u);
    // A box with a point of one side pushed out through the opposite one meets itself where the other box cuts it.
    RenderMesh knot = one;
    for (Vec3& X : knot.points)
        if ((X - Vec3(-.5, 1. / 6, 1. / 6)).norm() < 1e-9) X.x() = .7;
    const UnitedMesh met = unitedMesh(with(knot, one, Vec3(.9, .66, .2)), .1);
    EXPECT_EQ(met.shells, 2u);
    EXPECT_FALSE(met.mesh);
}

}  // namespace
}  // namespace vdbfrac::solids
