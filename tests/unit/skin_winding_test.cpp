// Which side of a mesh is outside says the material, not the mesh.
#include "lattices.h"
#include "voxel_box.h"

#include <vdbfrac/skin/skin.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

using namespace vdbfrac;
using tetmesh::CutMesh;

namespace {

class SkinWinding : public test::Lattices {};
INSTANTIATE_TEST_SUITE_P(All, SkinWinding, test::kLattices, test::nameOfLattice);

/// Six times the volume inside; negative where the surface is inside out.
double sixVolumes(const tetmesh::DrawnTopology& drawn)
{
    double sum = 0;
    for (std::size_t f = 0; f < drawn.mesh.faces(); ++f) {
        const auto face = drawn.mesh.face(f);
        const Vec3 A = drawn.mesh.points[face[0].point];
        for (std::size_t k = 2; k < face.size(); ++k) {
            const Vec3 B = drawn.mesh.points[face[k - 1].point], C = drawn.mesh.points[face[k].point];
            sum += A.dot(B.cross(C));
        }
    }
    return sum;
}

/// The way corners run is what a program that wrote the mesh took for it, for each of its parts.
TEST_P(SkinWinding, MeshesInsideOutAreTurned)
{
    constexpr double kRounding = 1e-9;
    const Coord half{6, 6, 3};
    const CutMesh body(GetParam(),
                       lab::sample({-10, -10, -10}, {10, 10, 10}, dx, test::boxAt(Vec3::Zero(), dx * half.toVec())));
    const tetmesh::RenderMesh box = test::withNormals(test::voxelBox(half, dx));
    tetmesh::RenderMesh insideOut = box;
    for (std::size_t f = 0, begin = 0; f < box.faces(); begin = box.faceEnd[f++])
        std::reverse(insideOut.corners.begin() + std::ptrdiff_t(begin), insideOut.corners.begin() + box.faceEnd[f]);
    tetmesh::RenderMesh both = insideOut;  // normals too
    for (Vec3& n : both.normals) n = -n;
    std::vector<std::uint32_t> whole(body.nodeCount(), 0);
    const auto drawnOf = [&](const tetmesh::RenderMesh& mesh) {
        skin::Skin skin(mesh, body, {});
        skin.follow(body, whole);
        return skin.topology();
    };
    const auto right = drawnOf(box);
    EXPECT_GT(sixVolumes(*right), 0);
    for (const tetmesh::RenderMesh& mesh : {insideOut, both}) {
        const auto drawn = drawnOf(mesh);
        EXPECT_NEAR(sixVolumes(*drawn), sixVolumes(*right), kRounding);
        ASSERT_EQ(drawn->mesh.normals.size(), right->mesh.normals.size());
        for (std::size_t n = 0; n < drawn->mesh.normals.size(); ++n)
            EXPECT_LT((drawn->mesh.normals[n] - right->mesh.normals[n]).norm(), kRounding);
    }
}

}  // namespace
