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

/// Equal normals are often written once: those of a part that is turned are not taken from one that is not.
TEST_P(SkinWinding, PartsMayShareNormals)
{
    const Coord half{4, 4, 3};
    const Vec3 aside(.8, 0, 0);
    const auto boxes = [&](const Vec3& X) {
        return std::min(test::boxAt(-aside, dx * half.toVec())(X), test::boxAt(aside, dx * half.toVec())(X));
    };
    const CutMesh body(GetParam(), lab::sample({-16, -10, -10}, {16, 10, 10}, dx, boxes));
    tetmesh::RenderMesh mesh = test::voxelBox(half, dx);
    const std::size_t points = mesh.points.size(), corners = mesh.corners.size(), faces = mesh.faces();
    for (std::size_t p = 0; p < points; ++p) mesh.points.push_back(mesh.points[p] + aside), mesh.points[p] -= aside;
    for (std::size_t f = 0; f < faces; ++f) {
        auto face =
            std::vector(mesh.corners.begin() + std::ptrdiff_t(4 * f), mesh.corners.begin() + std::ptrdiff_t(4 * f + 4));
        for (auto& corner : face) corner.point += std::uint32_t(points);
        std::reverse(face.begin(), face.end());  // inside out
        mesh.addFace(face, tetmesh::RenderMesh::kNone, tetmesh::RenderMesh::kNone);
    }
    ASSERT_EQ(mesh.corners.size(), 2 * corners);
    const auto normalOf = [](const tetmesh::RenderMesh& m, std::size_t f) {
        const auto face = m.face(f);
        const auto at = [&](std::size_t k) { return m.points[face[k].point]; };
        return Vec3((at(1) - at(0)).cross(at(2) - at(0)).normalized());
    };
    for (int axis = 0; axis < 3; ++axis)
        for (int side : {-1, 1}) mesh.normals.push_back(side * Vec3::Unit(axis));
    for (std::size_t f = 0; f < mesh.faces(); ++f)
        for (std::size_t n = 0; n < mesh.normals.size(); ++n)
            if (mesh.normals[n].dot(normalOf(mesh, f)) > .9)
                for (std::size_t k = 0; k < 4; ++k) mesh.corners[4 * f + k].normal = std::uint32_t(n);
    skin::Skin skin(mesh, body, {}, true);
    skin.follow(body, std::vector<std::uint32_t>(body.nodeCount(), 0));
    const auto drawn = skin.topology();
    EXPECT_GT(sixVolumes(*drawn), 0);
    for (std::size_t f = 0; f < drawn->mesh.faces(); ++f)
        for (const tetmesh::RenderMesh::Corner& c : drawn->mesh.face(f)) {
            ASSERT_NE(c.normal, tetmesh::RenderMesh::kNone);
            EXPECT_GT(drawn->mesh.normals[c.normal].dot(normalOf(drawn->mesh, f)), .9);
        }
}

}  // namespace
