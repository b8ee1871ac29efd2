// The two lips of a crack go each with its own material, from its front on.
#include "lattices.h"
#include "voxel_box.h"

#include <vdbfrac/skin/mean_motion.h>
#include <vdbfrac/skin/skin.h>
#include <vdbfrac/tetmesh/nodes_where.h>

#include <gtest/gtest.h>

#include <algorithm>

using namespace vdbfrac;
using test::voxelBox;
using tetmesh::CutMesh;

namespace {

class SkinLips : public test::Lattices {};
INSTANTIATE_TEST_SUITE_P(All, SkinLips, test::kLattices, test::nameOfLattice);

/// 1 along x for the nodes that have material on one side of the plane x = 0 only: below it (-1) or above it (1).
std::vector<Vec3> nodesOn(const CutMesh& body, int side)
{
    std::vector<std::uint8_t> sides(body.nodeCount(), 0);
    for (const Coord& voxel : tetmesh::nodesWhere(body.phi(), [&](Coord n) { return body.phi()(n) < 0 && n.x != 0; })) {
        std::vector<tetmesh::TetShare> tets;
        body.addTetsRound(voxel, tets);
        for (const tetmesh::TetShare& tet : tets)
            for (const std::uint32_t n : body.restTet(tet.element, std::uint32_t(tet.tet)).node)
                sides[n] |= voxel.x < 0 ? 1 : 2;
    }
    std::vector<Vec3> on;
    for (const std::uint8_t s : sides) on.push_back((s == (side < 0 ? 1 : 2)) * Vec3::UnitX());
    return on;
}

/// A little way behind the front of a crack each lip goes along with its own material alone, though the other is as
/// near.
TEST_P(SkinLips, PartFromTheFrontOn)
{
    constexpr double kBehind = 1.5;  // voxels, or edges of tets
    const Coord half{6, 6, 3};
    CutMesh body(GetParam(),
                 lab::sample({-10, -10, -10}, {10, 10, 10}, dx, test::boxAt(Vec3::Zero(), dx * half.toVec())));
    skin::Skin skin(voxelBox(half, dx), body, {});
    body.update(test::raised(body, {-9, -9, -9}, {9, 9, 9},
                             [](const Vec3& p) { return std::min(1.2 * dx - std::abs(p.x()), .5 * dx - p.y()); }));
    skin.follow(body, std::vector<std::uint32_t>(body.nodeCount(), 0));
    const tetmesh::RenderMesh& mesh = skin.topology()->mesh;
    const std::vector<Vec3> below = skin.carried(nodesOn(body, -1)), above = skin.carried(nodesOn(body, 1));
    double mixed = 0;
    int behind = 0;
    for (std::size_t f = 0; f < mesh.faces(); ++f) {
        if (!skin.topology()->torn[f]) continue;
        for (const tetmesh::RenderMesh::Corner& c : mesh.face(f)) {
            if (mesh.points[c.point].y() > -kBehind * GetParam().coarsening * dx) continue;
            ++behind, mixed = std::max(mixed, std::min(below[c.point].norm(), above[c.point].norm()));
        }
    }
    EXPECT_GT(behind, 50);
    EXPECT_EQ(mixed, 0);
}

/// A crack as thin as cracks begin, oblique to the skin: skin and torn faces end where the material does, and none
/// joins both lips but round the front.
TEST_P(SkinLips, NoFaceJoinsThoseOfAThinCrack)
{
    constexpr double radius = .6, kFront = .3;
    const Vec3 middle(.3, 0, 0);
    CutMesh body(GetParam(), lab::sample({-12, -12, -12}, {12, 12, 12}, dx,
                                         [&](const Vec3& p) { return (p - middle).norm() - radius; }));
    tetmesh::RenderMesh ball = voxelBox({6, 6, 6}, dx);
    for (Vec3& p : ball.points) p = middle + radius * p.normalized();
    skin::Skin skin(ball, body, {skin::Lips::closed, {}});
    body.update(test::raised(body, {-11, -11, -11}, {11, 11, 11},
                             [](const Vec3& p) { return std::min((p.x() == 0 ? .1 : -.9) * dx, kFront - p.y()); }));
    skin.follow(body, std::vector<std::uint32_t>(body.nodeCount(), 0));
    const tetmesh::DrawnTopology& drawn = *skin.topology();
    const std::vector<Vec3> below = skin.carried(nodesOn(body, -1)), above = skin.carried(nodesOn(body, 1));
    // The front is as ragged as its tets.
    for (const auto& [behind, share] : {std::pair(1, .01), std::pair(2, .0015)}) {
        int faces = 0, joins = 0;
        for (std::size_t f = 0; f < drawn.mesh.faces(); ++f) {
            double least = 1, most = -1, front = -1e9;  // of the side: -1 is below the crack, 1 above
            for (const tetmesh::RenderMesh::Corner& c : drawn.mesh.face(f)) {
                const double side = above[c.point].x() - below[c.point].x();
                least = std::min(least, side), most = std::max(most, side);
                front = std::max(front, drawn.mesh.points[c.point].y());
            }
            if (front > kFront - behind * GetParam().coarsening * dx) continue;
            ++faces, joins += least < -.5 && most > .5;
        }
        EXPECT_GT(faces, 30);
        EXPECT_LE(joins, share * faces) << behind << " voxels behind the front";
    }
}

/// Where a point is taken for one of the wrong lip, those next to it tell.
TEST(MeanMotion, IsEvenedOutAlongEdges)
{
    constexpr double kRounding = 1e-12, dx = 0.1;
    CutMesh body({tetmesh::Lattice::Kind::six, 1, dx},
                 lab::sample({-10, -10, -10}, {10, 10, 10}, dx, test::boxAt(Vec3::Zero(), Vec3(.6, .6, .3))));
    body.update(test::raised(body, {-9, -9, -9}, {9, 9, 9}, [](const Vec3& p) { return 1.2 * dx - std::abs(p.x()); }));
    std::vector<skin::Rider> riders;
    std::vector<std::array<std::uint32_t, 2>> edges;
    for (std::uint32_t i = 0; i < 7; ++i) {
        riders.push_back({Vec3(0, .1 * dx * i, 0), Coord{i == 3 ? 3 : -3, 0, 0}});
        if (i > 0) edges.push_back({i - 1, i});
    }
    const skin::CrackField cracks = skin::crackField(body.restPhi(), body.phi(), dx);
    const std::vector<std::uint32_t> fragment(body.nodeCount(), 0);
    const skin::Embedded embedded = skin::embedRiders(body, cracks, riders, {}, fragment);
    skin::MeanMotion motion(body, cracks, riders, embedded, {}, fragment);
    const auto wrong = [&] {
        std::vector<double> share;
        for (const Vec3& value : motion.at(nodesOn(body, 1))) share.push_back(value.x());
        return share;
    };
    const std::vector<double> before = wrong();
    for (std::uint32_t i = 0; i < 7; ++i) EXPECT_NEAR(before[i], i == 3, kRounding);
    motion.evenOut(edges);
    const std::vector<double> after = wrong();
    // Four times: half its own and half the mean of those beside it, of which the second ones are all right.
    for (const auto& [i, share] : {std::pair{1, 0.}, {2, .1875}, {3, .265625}, {4, .1875}, {5, 0.}})
        EXPECT_NEAR(after[std::size_t(i)], share, kRounding) << i;
}

}  // namespace
