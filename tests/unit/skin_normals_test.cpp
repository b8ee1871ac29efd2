// Given normals turn with the surface that is drawn.
#include "lattices.h"
#include "voxel_box.h"

#include <vdbfrac/skin/skin.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

using namespace vdbfrac;
using tetmesh::CutMesh;

namespace {

class SkinNormals : public test::Lattices {};
INSTANTIATE_TEST_SUITE_P(All, SkinNormals, test::kLattices, test::nameOfLattice);

/// A body folded along a line through nodes is the same all along that line, and so are its normals, whichever tet
/// carries a point; sharp edges stay sharp.
TEST_P(SkinNormals, AreAlikeAlongAFold)
{
    constexpr double kRounding = 1e-9, kFold = .5;
    const Coord half{6, 6, 3};
    CutMesh body(GetParam(),
                 lab::sample({-10, -10, -10}, {10, 10, 10}, dx, test::boxAt(Vec3::Zero(), dx * half.toVec())));
    skin::Skin skin(test::withNormals(test::voxelBox(half, dx)), body, {});
    skin.follow(body, std::vector<std::uint32_t>(body.nodeCount(), 0));
    std::vector<Vec3> x = tetmesh::restPositions(body);
    for (Vec3& p : x) p.z() += kFold * std::max(0., p.y());
    const std::vector<Vec3> normals = skin.normals(skin.carried(x));
    const tetmesh::RenderMesh& mesh = skin.topology()->mesh;
    const Vec3 tilted = Vec3(0, -kFold, 1).normalized();
    std::size_t onFold = 0;
    for (const tetmesh::RenderMesh::Corner& c : mesh.corners) {
        const Vec3 X = mesh.points[c.point] / dx, N = mesh.normals[c.normal], now = normals[c.normal];
        if (N.z() < .9 || std::abs(X.x()) > 3.5) continue;  // two faces away from an edge nothing is seen of it
        const Vec3 expected = X.y() < -1.5 ? N : X.y() > 1.5 ? tilted : (N + tilted).normalized();
        if (std::abs(X.y()) < .5) {
            EXPECT_LT((now - expected).norm(), .02);
            ++onFold;
        } else if (std::abs(X.y()) > 1.5 && std::abs(X.y()) < 3.5) {
            EXPECT_LT((now - expected).norm(), kRounding);
        }
    }
    EXPECT_GT(onFold, 5u);
}

}  // namespace
