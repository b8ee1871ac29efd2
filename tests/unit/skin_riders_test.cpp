// Points of the drawn surface go where the material goes that they lie in.
#include "lattices.h"
#include "voxel_box.h"

#include <vdbfrac/skin/mean_motion.h>
#include <vdbfrac/skin/opposite.h>
#include <vdbfrac/skin/skin.h>
#include <vdbfrac/tetmesh/fragments.h>
#include <vdbfrac/tetmesh/nodes_where.h>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

using namespace vdbfrac;
using test::voxelBox;
using test::withNormals;
using tetmesh::CutMesh;

namespace {

class SkinRiders : public test::Lattices {};
INSTANTIATE_TEST_SUITE_P(All, SkinRiders, test::kLattices, test::nameOfLattice);

/// Faces on voxel planes are where the nodes with material and the points are least alike: at an edge no tet of the
/// nearest node inside need have the point.
TEST_P(SkinRiders, RideInTheTetsThatTheyLieIn)
{
    constexpr double kRounding = 1e-12;
    const Coord half{6, 6, 3};
    const test::Phi phi = test::boxAt(Vec3::Zero(), dx * half.toVec());
    const tetmesh::RestShape shape = [&](std::span<const Vec3> X, std::span<double> values) {
        std::transform(X.begin(), X.end(), values.begin(), phi);
    };
    const CutMesh body(GetParam(), lab::sample({-10, -10, -10}, {10, 10, 10}, dx, phi), shape);
    const tetmesh::RenderMesh mesh = voxelBox(half, dx);
    skin::Skin skin(mesh, body, {});
    const std::vector<std::uint32_t> fragments(body.nodeCount(), 0);
    skin.follow(body, fragments);

    std::mt19937 random(5);
    std::uniform_real_distribution<double> anywhere(-dx, dx);
    std::vector<Vec3> x = tetmesh::restPositions(body);
    for (Vec3& p : x) p += Vec3(anywhere(random), anywhere(random), anywhere(random));
    const std::vector<Vec3> at = skin.carried(x);
    ASSERT_EQ(at.size(), mesh.points.size());
    for (std::size_t i = 0; i < at.size(); ++i) {
        const auto in = body.locate(mesh.points[i]);
        ASSERT_TRUE(in) << mesh.points[i].transpose();
        EXPECT_LT((at[i] - in->point.at(x)).norm(), kRounding) << mesh.points[i].transpose();
    }
}

/// Whatever cracks there are, and wherever points ride: an affine motion of the nodes is one of all points, and given
/// normals stay at right angles to what they were at right angles to.
TEST_P(SkinRiders, TakePartInAffineMotions)
{
    constexpr double kRounding = 1e-11;  // of normals of slivers at rims; of points a hundredth of that
    const Coord half{6, 6, 3};
    CutMesh body(GetParam(),
                 lab::sample({-10, -10, -10}, {10, 10, 10}, dx, test::boxAt(Vec3::Zero(), dx * half.toVec())));
    for (const skin::Lips lips : {skin::Lips::closed, skin::Lips::asSimulated}) {
        skin::Skin skin(withNormals(voxelBox(half, dx)), body, {lips, {}});
        CutMesh torn = body;
        torn.update(test::raised(torn, {-9, -9, -9}, {9, 9, 9},
                                 [](const Vec3& p) { return .1 - std::abs(p.x() + .3 * p.y() - .02); }));
        skin.follow(torn, std::vector<std::uint32_t>(torn.nodeCount(), 0), skin::Taken::kept);
        const tetmesh::DrawnTopology& drawn = *skin.topology();
        EXPECT_GT(drawn.taken[1], drawn.taken[0]);
        EXPECT_GT(std::count(drawn.torn.begin(), drawn.torn.end(), 1), 100);

        const Mat3 A = (Mat3() << 1.3, .2, -.1, .4, .8, .3, -.2, .1, 1.1).finished();
        const Vec3 b(3, -2, 1);
        std::vector<Vec3> x = tetmesh::restPositions(torn);
        for (Vec3& p : x) p = A * p + b;
        const std::vector<Vec3> at = skin.carried(x);
        for (const tetmesh::RenderMesh::Corner& c : drawn.mesh.corners)
            EXPECT_LT((at[c.point] - A * drawn.mesh.points[c.point] - b).norm(), .01 * kRounding);
        const std::vector<Vec3> normals = skin.normals(at);
        const Mat3 turned = A.inverse().transpose();
        for (std::size_t f = 0; f < drawn.mesh.faces(); ++f) {
            if (drawn.torn[f]) continue;
            for (const tetmesh::RenderMesh::Corner& c : drawn.mesh.face(f))
                EXPECT_LT((normals[c.normal] - (turned * drawn.mesh.normals[c.normal]).normalized()).norm(), kRounding);
        }
    }
}

/// Torn faces of a body as they are drawn at rest, and normals of the outer surface at rims.
struct TornAtRest {
    std::vector<std::array<std::uint32_t, 3>> faces;
    std::vector<Vec3> normal;
};

TornAtRest tornAtRest(const tetmesh::DrawnTopology& drawn)
{
    const tetmesh::RenderMesh& mesh = drawn.mesh;
    TornAtRest torn{{}, std::vector<Vec3>(mesh.points.size(), Vec3::Zero())};
    for (std::size_t f = 0; f < mesh.faces(); ++f) {
        const auto c = mesh.face(f);
        if (drawn.torn[f]) torn.faces.push_back({c[0].point, c[1].point, c[2].point});
        if (drawn.torn[f]) continue;
        const Vec3& X = mesh.points[c[0].point];
        const Vec3 normal = (mesh.points[c[1].point] - X).cross(mesh.points[c[2].point] - X).normalized();
        for (const auto& corner : c) torn.normal[corner.point] += normal;
    }
    return torn;
}

/// The two sides of a crack are made fair each by itself, and then lie on each other: no line shows on the skin before
/// it opens.
TEST_P(SkinRiders, ClosedLipsMeet)
{
    constexpr double kRims = .01, kFaces = .1;  // voxels
    const Coord half{6, 6, 3};
    CutMesh body(GetParam(),
                 lab::sample({-10, -10, -10}, {10, 10, 10}, dx, test::boxAt(Vec3::Zero(), dx * half.toVec())));
    skin::Skin skin(voxelBox(half, dx), body, {});
    body.update(test::raised(body, {-9, -9, -9}, {9, 9, 9}, [](const Vec3& p) {
        return .7 * dx - std::abs(p.x() + dx * std::sin(4 * p.y()) + .3 * p.z() - .02);
    }));
    skin.follow(body, std::vector<std::uint32_t>(body.nodeCount(), 0));
    const std::vector<Vec3>& X = skin.topology()->mesh.points;
    const TornAtRest torn = tornAtRest(*skin.topology());
    std::set<std::uint32_t> rim, inner;
    for (const auto& t : torn.faces)
        for (const std::uint32_t p : t) (torn.normal[p].isZero() ? inner : rim).insert(p);
    const auto expectClose = [&](const std::vector<skin::Opposite>& lips, std::size_t of, double limit) {
        std::vector<double> apart(of, 1);  // where there is none opposite
        for (std::size_t i = 0; i < lips.size(); ++i) apart[i] = (lips[i].at(X) - X[lips[i].point]).norm() / dx;
        std::ranges::sort(apart);
        EXPECT_GT(of, 50u);
        EXPECT_LT(apart[of * 95 / 100], limit);
    };
    expectClose(skin::oppositeRims(X, torn.faces, torn.normal, dx), rim.size(), kRims);
    expectClose(skin::oppositeFaces(X, torn.faces, torn.normal, dx), inner.size(), kFaces);
}

/// Where cracks close something off on all sides, it goes with what is beyond them, be that a node in a crack.
TEST(MeanMotion, IsThatOfTheNodeWhereNoOtherIsJoinedToIt)
{
    constexpr double dx = 0.1;
    CutMesh body({tetmesh::Lattice::Kind::six, 1, dx},
                 lab::sample({-10, -10, -10}, {10, 10, 10}, dx, test::boxAt(Vec3::Zero(), Vec3(.6, .6, .3))));
    skin::CrackField cracks = skin::crackField(body.restPhi(), body.phi(), dx);
    body.phi().forEachBlock([&](Coord low) {
        tetmesh::NodeField<float>::forEachNode(low, [&](Coord n) {
            if (cracks.c.contains(n)) cracks.c.set(n, float(dx));
        });
    });
    const std::vector<skin::Rider> riders{{Vec3(.7, 0, 0), {5, 0, 0}}};
    const std::vector<std::uint32_t> fragment(body.nodeCount(), 0);
    const skin::Embedded embedded = skin::embedRiders(body, cracks, riders, {}, fragment);
    const skin::MeanMotion motion(body, cracks, riders, embedded, {}, fragment);
    ASSERT_EQ(motion.points().size(), 1u);
    EXPECT_LT((motion.at(tetmesh::restPositions(body))[0] - riders[0].X).norm(), 1e-12);
}

/// A lip drawn in the middle of a gap rides outside of the material. Carried by one tet it would swing with a corner of
/// it, and one node moved points up to 3 times as far as itself (on `six1`; the least, on `six3`, is 1.7).
TEST_P(SkinRiders, GoLittleFartherThanTheNodesThatCarryThem)
{
    const Coord half{6, 6, 3};
    CutMesh body(GetParam(),
                 lab::sample({-10, -10, -10}, {10, 10, 10}, dx, test::boxAt(Vec3::Zero(), dx * half.toVec())));
    skin::Skin skin(voxelBox(half, dx), body, {});
    body.update(test::raised(body, {-9, -9, -9}, {9, 9, 9},
                             [](const Vec3& p) { return dx - std::abs(p.x() + .3 * p.y() - .02); }));
    skin.follow(body, std::vector<std::uint32_t>(body.nodeCount(), 0));
    std::vector<Vec3> moved(body.nodeCount(), Vec3::Zero());
    double farthest = 0;
    for (std::size_t n = 0; n < moved.size(); ++n) {
        moved[n] = Vec3::UnitX();
        for (const Vec3& p : skin.carried(moved)) farthest = std::max(farthest, p.norm());
        moved[n].setZero();
    }
    EXPECT_GE(farthest, 1);  // of those that lie on nodes
    EXPECT_LE(farthest, 1.5);
}

/// phi of a face on voxel nodes is 0 but for its last bits. Where these are below 0 the nodes hold no material, so
/// nothing ever tears them, and they must not hold the sides of a crack together.
TEST_P(SkinRiders, PartWhereTheSkinLiesOnNodesBelowZero)
{
    constexpr double kLastBits = 1e-9, kRounding = 1e-12;
    const Coord half{6, 6, 3};
    const test::Phi box = test::boxAt(Vec3::Zero(), dx * half.toVec());
    CutMesh body(GetParam(), lab::sample({-10, -10, -10}, {10, 10, 10}, dx, [&](const Vec3& p) {
                     const double phi = box(p);
                     return std::abs(phi) < kLastBits ? -kLastBits : phi;
                 }));
    skin::Skin skin(voxelBox(half, dx), body, {});
    auto raised = test::raised(body, {-9, -9, -9}, {9, 9, 9}, [](const Vec3& p) { return 1.2 * dx - std::abs(p.x()); });
    std::erase_if(raised, [&](const auto& change) { return body.phi()(change.voxel) > -tetmesh::kSnap * dx; });
    body.update(raised);
    std::uint32_t nextId = 0;
    const tetmesh::FragmentTracker fragments(body, nextId);
    ASSERT_EQ(fragments.fragments().size(), 2u);
    skin.follow(body, fragments.ofNode());
    EXPECT_EQ(skin.work().bridges, 0);
    EXPECT_EQ(skin.work().defects, 0);
    // There is no mean of no material: such points ride on their tets alone, and those beside them take nothing of it.
    const std::vector<Vec3> at = skin.carried(tetmesh::restPositions(body));
    const tetmesh::RenderMesh& mesh = skin.topology()->mesh;
    for (const tetmesh::RenderMesh::Corner& c : mesh.corners)
        EXPECT_LT((at[c.point] - mesh.points[c.point]).norm(), kRounding) << mesh.points[c.point].transpose();
}

/// A skin round parts that are apart at rest, as what joins them is thinner than voxels see, goes along with each of
/// them.
TEST_P(SkinRiders, PartBetweenWhatIsApartAtRest)
{
    const Coord half{6, 6, 3};
    const test::Phi box = test::boxAt(Vec3::Zero(), dx * half.toVec());
    for (const Vec3& normal : {Vec3(1, 0, 0), Vec3(.8, .6, 0)}) {
        const CutMesh body(GetParam(), lab::sample({-10, -10, -10}, {10, 10, 10}, dx, [&](const Vec3& p) {
                               return std::max(box(p), 1.4 * dx - std::abs(normal.dot(p)));
                           }));
        std::uint32_t nextId = 0;
        const tetmesh::FragmentTracker fragments(body, nextId);
        ASSERT_EQ(fragments.fragments().size(), 2u);
        constexpr bool kIsInParts = true;
        skin::Skin skin(voxelBox(half, dx), body, {}, kIsInParts);
        skin.follow(body, fragments.ofNode());
        EXPECT_EQ(skin.work().bridges, 0);
        EXPECT_EQ(skin.work().defects, 0);
        EXPECT_GT(skin.work().tornFaces, 0);
    }
}

/// A body that cracks have eaten up is drawn as nothing, with the points and normals that were given.
TEST_P(SkinRiders, MayHaveNoMaterialLeft)
{
    const Coord half{6, 6, 3};
    CutMesh body(GetParam(),
                 lab::sample({-10, -10, -10}, {10, 10, 10}, dx, test::boxAt(Vec3::Zero(), dx * half.toVec())));
    tetmesh::RenderMesh mesh = voxelBox(half, dx);
    mesh.normals = {Vec3::UnitX()};
    for (auto& corner : mesh.corners) corner.normal = 0;
    skin::Skin skin(mesh, body, {});
    body.update(test::raised(body, {-9, -9, -9}, {9, 9, 9}, [](const Vec3&) { return dx; }));
    ASSERT_EQ(body.nodeCount(), 0u);
    skin.follow(body, {});
    EXPECT_EQ(skin.topology()->mesh.faces(), 0u);
    const std::vector<Vec3> at = skin.carried({});
    EXPECT_EQ(at.size(), skin.topology()->mesh.points.size());
    EXPECT_EQ(skin.normals(at).size(), skin.topology()->mesh.normals.size());
}

/// A fin that is thinner than voxels has no material of its own, however long it is: it goes along with what is
/// nearest.
TEST_P(SkinRiders, GoWithTheNearestMaterialFromAfar)
{
    constexpr double kRounding = 1e-9;
    const Coord half{6, 6, 3};
    const CutMesh body(GetParam(),
                       lab::sample({-10, -10, -10}, {10, 10, 10}, dx, test::boxAt(Vec3::Zero(), dx * half.toVec())));
    tetmesh::RenderMesh mesh = voxelBox(half, dx);
    const auto first = std::uint32_t(mesh.points.size());
    for (const Vec3& X : {Vec3(6, .1, 0), Vec3(6, -.1, 0), Vec3(90, 0, 40)}) mesh.points.push_back(dx * X);
    const tetmesh::RenderMesh::Corner fin[2][3] = {{{first}, {first + 1}, {first + 2}},
                                                   {{first}, {first + 2}, {first + 1}}};
    for (const auto& side : fin) mesh.addFace(side, tetmesh::RenderMesh::kNone, tetmesh::RenderMesh::kNone);
    skin::Skin skin(mesh, body, {});
    skin.follow(body, std::vector<std::uint32_t>(body.nodeCount(), 0));
    EXPECT_GE(skin.work().far, 1);
    Mat3 F;
    F << 1.1, .2, 0, -.1, .9, .3, .2, 0, 1.2;
    std::vector<Vec3> x = tetmesh::restPositions(body);
    for (Vec3& p : x) p = F * p;
    EXPECT_LT((skin.carried(x)[first + 2] - F * mesh.points[first + 2]).norm(), kRounding);
}

/// Cracks that cross and end in each other, some thinner than what tells a crack: no face may join two fragments.
TEST_P(SkinRiders, StayWithTheirFragmentsAmongManyCracks)
{
    const Coord half{6, 6, 6};
    const test::Phi box = test::boxAt(Vec3::Zero(), dx * half.toVec());
    std::mt19937 random(3);
    std::uniform_real_distribution<double> anywhere(-1, 1);
    for (int round = 0; round < 20; ++round) {
        CutMesh body(GetParam(), lab::sample({-10, -10, -10}, {10, 10, 10}, dx, box));
        skin::Skin skin(voxelBox(half, dx), body, {});
        for (int crack = 0; crack < 4; ++crack) {
            const Vec3 normal = Vec3(anywhere(random), anywhere(random), anywhere(random)).normalized();
            const double offset = .4 * anywhere(random), width = (.9 + .3 * anywhere(random)) * dx;
            body.update(test::raised(body, {-9, -9, -9}, {9, 9, 9},
                                     [&](const Vec3& p) { return width - std::abs(normal.dot(p) - offset); }));
        }
        std::uint32_t nextId = 0;
        const tetmesh::FragmentTracker fragments(body, nextId);
        EXPECT_GT(fragments.alive(), 4u);
        skin.follow(body, fragments.ofNode());
        EXPECT_EQ(skin.work().bridges, 0) << "round " << round;
        EXPECT_EQ(skin.work().defects, 0) << "round " << round;
    }
}

}  // namespace
