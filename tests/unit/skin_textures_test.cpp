// Texture coordinates of what cracks leave of the outer surface, where lips are closed.
#include "lattices.h"
#include "voxel_box.h"

#include <vdbfrac/base/triangle.h>
#include <vdbfrac/skin/skin.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

namespace vdbfrac {
namespace {

using namespace test;

class SkinTextures : public Lattices {};
INSTANTIATE_TEST_SUITE_P(All, SkinTextures, kLattices, nameOfLattice);

/// A texture that changes from voxel to voxel, the same one hundred units on in faces right of x = 0.
Vec3 textureAt(const Vec3& X) { return {std::sin(31 * X.x() + 17 * X.y()), std::cos(23 * X.y() - 29 * X.z()), 0}; }

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

/// Rims that have moved have the texture of the place where they are, but none from beyond a seam: there it is that of
/// the nearest place on their own side.
TEST_P(SkinTextures, AreThoseOfThePlaceAsFarAsTheSeam)
{
    constexpr double kRounding = 1e-9, kOther = 100;
    const Coord half{6, 6, 3};
    tetmesh::RenderMesh mesh = voxelBox(half, dx);
    for (std::size_t f = 0; f < mesh.faces(); ++f) {
        double x = 0;
        for (const auto& c : mesh.face(f)) x += mesh.points[c.point].x();
        const std::size_t end = mesh.faceEnd[f];
        for (std::size_t c = end - mesh.face(f).size(); c < end; ++c) {
            mesh.corners[c].uv = std::uint32_t(mesh.uvs.size());
            mesh.uvs.push_back(textureAt(mesh.points[mesh.corners[c].point]) + (x > 0 ? kOther : 0) * Vec3::UnitX());
        }
    }
    const tetmesh::Fans fans = tetmesh::fansOf(mesh);
    tetmesh::CutMesh body(GetParam(),
                          lab::sample({-10, -10, -10}, {10, 10, 10}, dx, boxAt(Vec3::Zero(), dx * half.toVec())));
    skin::Skin skin(mesh, body, {});
    body.update(raised(body, {-9, -9, -9}, {9, 9, 9},
                       [](const Vec3& p) { return dx - std::abs(p.x() + .3 * p.y() - .2 * dx); }));
    skin.follow(body, std::vector<std::uint32_t>(body.nodeCount(), 0), skin::Taken::kept);
    const tetmesh::DrawnTopology& now = *skin.topology();
    int moved = 0, clamped = 0;
    for (std::size_t f = 0; f < now.mesh.faces(); ++f) {
        if (now.torn[f]) continue;
        const auto face = now.mesh.face(f);
        const bool isRight = now.mesh.uvs[face[0].uv].x() > .5 * kOther;
        for (const auto& c : face) {
            Vec3 X = now.mesh.points[c.point];
            moved += c.point >= mesh.points.size();
            Vec3 normal = Vec3::Zero();  // of the side of the box that the whole face is on
            for (int k = 0; k < 3; ++k)
                for (const double side : {-1., 1.})
                    if (std::ranges::all_of(face, [&](const auto& other) {
                            return std::abs(now.mesh.points[other.point][k] - side * dx * half.toVec()[k]) < kRounding;
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

}  // namespace
}  // namespace vdbfrac
