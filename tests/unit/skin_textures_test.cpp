// Texture coordinates of what cracks leave of the outer surface, where lips are closed.
#include "lattices.h"
#include "voxel_box.h"

#include <vdbfrac/base/triangle.h>
#include <vdbfrac/skin/skin.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>

namespace vdbfrac {
namespace {

using namespace test;

/// A texture that changes from voxel to voxel, the same one hundred units on in faces right of x = 0.
Vec3 textureAt(const Vec3& X) { return {std::sin(31 * X.x() + 17 * X.y()), std::cos(23 * X.y() - 29 * X.z()), 0}; }

constexpr Coord kHalf{6, 6, 3};  // voxels

class SkinTextures : public Lattices {
protected:
    /// A box with the texture, `other` units on in faces right of x = 0.
    static tetmesh::RenderMesh texturedBox(double other)
    {
        tetmesh::RenderMesh mesh = voxelBox(kHalf, dx);
        for (std::size_t f = 0; f < mesh.faces(); ++f) {
            double x = 0;
            for (const auto& c : mesh.face(f)) x += mesh.points[c.point].x();
            const std::size_t end = mesh.faceEnd[f];
            for (std::size_t c = end - mesh.face(f).size(); c < end; ++c) {
                mesh.corners[c].uv = std::uint32_t(mesh.uvs.size());
                mesh.uvs.push_back(textureAt(mesh.points[mesh.corners[c].point]) + (x > 0 ? other : 0) * Vec3::UnitX());
            }
        }
        return mesh;
    }

    /// What is drawn of it when a crack has gone along x = 0, aslant.
    tetmesh::DrawnTopology tornBox(const tetmesh::RenderMesh& mesh) const
    {
        tetmesh::CutMesh body(GetParam(),
                              lab::sample({-10, -10, -10}, {10, 10, 10}, dx, boxAt(Vec3::Zero(), dx * kHalf.toVec())));
        skin::Skin skin(mesh, body, {});
        body.update(raised(body, {-9, -9, -9}, {9, 9, 9},
                           [this](const Vec3& p) { return dx - std::abs(p.x() + .3 * p.y() - .2 * dx); }));
        skin.follow(body, std::vector<std::uint32_t>(body.nodeCount(), 0), skin::Taken::kept);
        return *skin.topology();
    }
};
INSTANTIATE_TEST_SUITE_P(All, SkinTextures, kLattices, nameOfLattice);

/// A point of a face of the box that looks along `normal`: the texture between corners of the mesh.
Vec3 textureOf(const tetmesh::RenderMesh& mesh, const tetmesh::Fans& fans, const Vec3& X, const Vec3& normal)
{
    double nearest = std::numeric_limits<double>::infinity();
    Vec3 texture;
    for (const auto& t : fans.corners) {
        std::array<Vec3, 3> at;
        for (std::size_t k = 0; k < 3; ++k) at[k] = mesh.points[mesh.corners[t[k]].point];
        if ((at[1] - at[0]).cross(at[2] - at[0]).normalized().dot(normal) < .9) continue;
        const double d = (closestPoint(at, X).at - X).norm();
        if (d >= nearest) continue;
        nearest = d;
        const Vec3 w = sharesOf(at, X);
        texture = w[0] * textureAt(at[0]) + w[1] * textureAt(at[1]) + w[2] * textureAt(at[2]);
    }
    return texture;
}

/// Rims that have moved have the texture of the place where they are; a face over a seam has that of the side where its
/// middle lies, and corners beyond the seam that of the nearest place on it.
TEST_P(SkinTextures, AreThoseOfThePlaceAsFarAsTheSeam)
{
    constexpr double kRounding = 1e-9, kOther = 100;
    const tetmesh::RenderMesh mesh = texturedBox(kOther);
    const tetmesh::Fans fans = tetmesh::fansOf(mesh);
    const tetmesh::DrawnTopology now = tornBox(mesh);
    int moved = 0, clamped = 0;
    for (std::size_t f = 0; f < now.mesh.faces(); ++f) {
        if (now.torn[f]) continue;
        const auto face = now.mesh.face(f);
        const bool isRight = now.mesh.uvs[face[0].uv].x() > .5 * kOther;
        double middle = 0;  // along x
        for (const auto& c : face) middle += now.mesh.points[c.point].x() / 3;
        EXPECT_TRUE(isRight == (middle > 0) || std::abs(middle) < kRounding);
        for (const auto& c : face) {
            Vec3 X = now.mesh.points[c.point];
            moved += c.point >= mesh.points.size();
            Vec3 normal = Vec3::Zero();  // of the side of the box that the whole face is on
            for (int k = 0; k < 3; ++k)
                for (const double side : {-1., 1.})
                    if (std::ranges::all_of(face, [&](const auto& other) {
                            return std::abs(now.mesh.points[other.point][k] - side * dx * kHalf.toVec()[k]) < kRounding;
                        }))
                        normal[k] = side;
            ASSERT_GT(normal.norm(), 0);
            if (std::abs(normal.x()) < .5 && (isRight ? X.x() < 0 : X.x() > 0)) X.x() = 0, ++clamped;
            const Vec3 expected = textureOf(mesh, fans, X, normal) + (isRight ? kOther : 0) * Vec3::UnitX();
            EXPECT_LT((now.mesh.uvs[c.uv] - expected).norm(), kRounding);
        }
    }
    EXPECT_GT(moved, 100);
    EXPECT_GT(clamped, 10);
}

/// A seam that only cuts a tube open has the same chart on both sides, round the back: a face takes the side where its
/// middle lies all the same.
TEST_P(SkinTextures, AreThoseOfTheSideOfASeamThatCutsATubeOpen)
{
    constexpr double kOther = 100, kTurn = 2 * std::numbers::pi;
    tetmesh::RenderMesh mesh = texturedBox(0);
    const auto round = [](const Vec3& X, bool isLeft) {  // 0 to 1, from right of x = 0 at the top, clockwise
        const double angle = std::atan2(X.x(), X.z());
        return (angle < 0 || (angle == 0 && isLeft) ? angle + kTurn : angle) / kTurn;
    };
    for (std::size_t f = 0; f < mesh.faces(); ++f) {
        double x = 0;
        for (const auto& c : mesh.face(f)) x += mesh.points[c.point].x();
        for (const auto& c : mesh.face(f)) mesh.uvs[c.uv].x() += kOther * round(mesh.points[c.point], x < 0);
    }
    const tetmesh::DrawnTopology now = tornBox(mesh);
    int nearSeam = 0;
    for (std::size_t f = 0; f < now.mesh.faces(); ++f) {
        const auto face = now.mesh.face(f);
        const auto isAtTop = [&](const auto& c) {
            const Vec3& X = now.mesh.points[c.point];
            return std::abs(X.z() - dx * kHalf.z) < 1e-9 && std::abs(X.x()) < 2 * dx;
        };
        if (now.torn[f] || !std::ranges::all_of(face, isAtTop)) continue;
        double middle = 0;  // along x
        for (const auto& c : face) middle += now.mesh.points[c.point].x() / 3;
        if (std::abs(middle) < 1e-9) continue;
        ++nearSeam;
        for (const auto& c : face) EXPECT_EQ(now.mesh.uvs[c.uv].x() > .5 * kOther, middle < 0);
    }
    EXPECT_GT(nearSeam, 50);
}

/// Files would be several times as large if each part of a triangle had its own.
TEST_P(SkinTextures, AreGivenOnceForEachPointWithoutSeams)
{
    const tetmesh::RenderMesh mesh = texturedBox(0);
    const tetmesh::DrawnTopology now = tornBox(mesh);
    std::map<std::uint32_t, std::set<std::uint32_t>> uvsOf;  // of points that the cut made
    for (std::size_t f = 0; f < now.mesh.faces(); ++f)
        if (!now.torn[f] && !now.isTaken(f))
            for (const auto& c : now.mesh.face(f))
                if (c.point >= mesh.points.size()) uvsOf[c.point].insert(c.uv);
    EXPECT_GT(uvsOf.size(), 100u);
    for (const auto& [point, uvs] : uvsOf) EXPECT_EQ(uvs.size(), 1u);
}

}  // namespace
}  // namespace vdbfrac
