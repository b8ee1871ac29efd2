// Points of a skin at one place, as along its hard edges and seams.
#include "lattices.h"

#include <vdbfrac/skin/skin.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <array>
#include <random>

using namespace vdbfrac;
using tetmesh::CutMesh;

namespace {

class SkinPlaces : public test::Lattices {};
INSTANTIATE_TEST_SUITE_P(All, SkinPlaces, test::kLattices, test::nameOfLattice);

/// Points are given once for each face along hard edges and seams. Where they ride outside of the material their motion
/// is that of more than one tet, and still one: the skin stays closed.
TEST_P(SkinPlaces, PointsAtOnePlaceMoveAsOne)
{
    const Vec3 half(.55, .55, .3);
    const Mat3 turn = Eigen::AngleAxisd(.4, Vec3(1, 2, 3).normalized()).toRotationMatrix();
    const test::Phi box = test::boxAt(Vec3::Zero(), half);
    const CutMesh body(GetParam(), lab::sample({-10, -10, -10}, {10, 10, 10}, dx,
                                               [&](const Vec3& p) { return box(turn.transpose() * p); }));
    tetmesh::RenderMesh mesh;
    for (int axis : {0, 1, 2})
        for (double side : {-1., 1.}) {
            std::array<tetmesh::RenderMesh::Corner, 4> face;
            for (std::uint32_t k = 0; k < 4; ++k) {
                Vec3 X = Vec3::Constant(side);
                X[(axis + 1) % 3] = k == 1 || k == 2 ? 1 : -1;
                X[(axis + 2) % 3] = side * (k >= 2 ? 1 : -1);
                face[k].point = std::uint32_t(mesh.points.size());
                mesh.points.push_back(turn * half.cwiseProduct(X));
            }
            mesh.addFace(face, tetmesh::RenderMesh::kNone, tetmesh::RenderMesh::kNone);
        }
    skin::Skin skin(mesh, body, {});
    skin.follow(body, std::vector<std::uint32_t>(body.nodeCount(), 0));

    std::mt19937 random(5);
    std::uniform_real_distribution<double> anywhere(-dx, dx);
    std::vector<Vec3> x = tetmesh::restPositions(body);
    for (Vec3& p : x) p += Vec3(anywhere(random), anywhere(random), anywhere(random));
    const std::vector<Vec3> at = skin.carried(x);
    int copies = 0;
    for (std::size_t i = 0; i < at.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
            if (mesh.points[i] == mesh.points[j]) {
                ++copies;
                EXPECT_EQ(at[i], at[j]) << i << " " << j;
            }
    EXPECT_EQ(copies, 24);
}

}  // namespace
