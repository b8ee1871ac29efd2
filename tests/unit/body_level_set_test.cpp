// Bodies as level sets.
#include "folder_test.h"
#include "grid_bodies.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/body_level_set.h>
#include <vdbfrac/grid/phi_nodes.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>

using namespace vdbfrac;
using namespace vdbfrac::grid;
using namespace vdbfrac::test;
namespace fs = std::filesystem;
using std::numbers::pi;

namespace {

using BodyLevelSet = FolderTest;

TEST_F(BodyLevelSet, DefaultLevelSetIsEmpty)
{
    EXPECT_EQ(LevelSet().activeVoxels(), 0u);
    EXPECT_EQ(LevelSet().voxelSize(), 1);
    EXPECT_EQ(LevelSet().copy().background(), 3);
}

TEST_F(BodyLevelSet, SphereBoxAndTorusHaveTheirVolumes)
{
    const LevelSet ball = make(bodyOf(sphere(0.5)));
    expectLevelSet(ball);
    EXPECT_NEAR(volume(ball), 4. / 3 * pi * 0.125, kVolumeTolerance * 0.52);
    // Exact but for the voxels at edges and corners.
    EXPECT_NEAR(volume(make(bodyOf(box({1, 0.6, 0.8})))), 0.48, kVolumeTolerance * 0.48);
    Primitive torus;
    torus.kind = Primitive::Kind::torus;
    torus.radius = 0.5;
    torus.tube = 0.2;
    torus.axis = Vec3(1, 2, 2) / 3;
    const double exact = 2 * pi * pi * 0.5 * 0.04;
    EXPECT_NEAR(volume(make(bodyOf(torus))), exact, kVolumeTolerance * exact);
}

TEST_F(BodyLevelSet, EveryVoxelHoldsItsExactDistance)
{
    const Primitive solid = sphere(0.5);
    const LevelSet phi = make(bodyOf(solid));
    const double band = phi.background();
    const auto accessor = phi.grid().grid->getConstAccessor();
    std::size_t inBand = 0;
    const openvdb::CoordBBox all(openvdb::Coord(-25), openvdb::Coord(25));
    for (auto ijk = all.begin(); ijk; ++ijk) {
        const double exact = signedDistance(solid, kDx * fromVdb(*ijk).toVec());
        inBand += std::abs(exact) < band;
        ASSERT_NEAR(accessor.getValue(*ijk), std::clamp(exact, -band, band), 1e-6) << *ijk;
    }
    EXPECT_EQ(phi.activeVoxels(), inBand);
}

TEST_F(BodyLevelSet, SolidsAreUnitedThenTakenAway)
{
    scene::Body body = bodyOf(box({1, 0.6, 0.8}));
    body.add.push_back(sphere(0.2, {3, 0, 0}));
    Primitive half;
    half.kind = Primitive::Kind::halfspace;
    half.axis = Vec3::UnitX();
    half.offset = 0.007;
    const double ball = 4. / 3 * pi * 0.008;
    EXPECT_NEAR(volume(make(body)), 0.48 + ball, kVolumeTolerance * 0.48);
    body.cut.push_back(half);
    EXPECT_NEAR(volume(make(body)), 0.24, kVolumeTolerance * 0.48);
}

TEST_F(BodyLevelSet, SameBitsForAnyNumberOfThreads)
{
    scene::Body body = bodyOf(box({1, 0.6, 0.8}));
    body.cut.push_back(sphere(0.3, {0.5, 0, 0}));
    const LevelSet many = make(body);
    const ThreadLimit one(1);
    const LevelSet single = make(body);
    EXPECT_EQ(many.activeVoxels(), single.activeVoxels());
    EXPECT_EQ(difference(many, single), 0);
}

constexpr std::uint64_t kAnyMemory = 8'000'000'000;  // bytes

TEST_F(BodyLevelSet, PartsTooFarApartForOneBoxAreALimit)
{
    constexpr std::uint64_t kLimit = 100000000;  // bytes; the box of both balls has 250^3 leaves
    scene::Body body = bodyOf(sphere(0.5));
    body.add.push_back(sphere(0.5, Vec3::Constant(100)));
    EXPECT_THROW(sampleNodes(makeLevelSet(body, gridOf(kDx), kLimit), kLimit), LimitError);
    body.add.back() = sphere(0.5, Vec3::Constant(2));
    EXPECT_NO_THROW(sampleNodes(makeLevelSet(body, gridOf(kDx), kLimit), kLimit));
}

TEST_F(BodyLevelSet, PartsTooFarApartToNumberPlacesAreALimit)
{
    // As wide as places can be numbered, and no wider: beyond, corners of cells would share numbers with others.
    const auto apart = [](double voxels) {
        scene::Body body = bodyOf(sphere(4 * kDx));
        body.add.push_back(sphere(4 * kDx, {voxels * kDx, 0, 0}));
        return sampleNodes(makeLevelSet(body, gridOf(kDx), kAnyMemory), kAnyMemory);
    };
    EXPECT_NO_THROW(apart(262000));
    try {
        apart(262100);
        ADD_FAILURE() << "was taken";
    } catch (const LimitError& e) {
        EXPECT_NE(std::string(e.what()).find("at most 262080 along an axis"), std::string::npos) << e.what();
    }
}

TEST_F(BodyLevelSet, TheBoxOfNodesHoldsMaterialThatIsNotOfTheBand)
{
    const LevelSet phi = make(bodyOf(sphere(0.6)));
    openvdb::FloatTree& tree = phi.grid().grid->tree();
    openvdb::Coord farthest(0);
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf)
        for (auto v = leaf->cbeginValueOff(); v; ++v)
            if (v.getCoord().x() > farthest.x()) farthest = v.getCoord();
    ASSERT_GT(farthest.x(), sampleNodes(phi).upper().x);
    tree.probeLeaf(farthest)->setValueOnly(farthest, -1);
    const auto nodes = sampleNodes(phi);
    EXPECT_LT(nodes(fromVdb(farthest)), 0);
    EXPECT_GE(nodes.upper().x, farthest.x() + 2);
}

TEST_F(BodyLevelSet, MeshBodyEqualsTheAnalyticOne)
{
    scene::MeshFile mesh;
    mesh.file = write("cube.obj", cubeObj());
    mesh.scale = 0.5;
    mesh.rotate = Vec3(0, 0, 90);
    mesh.translate = Vec3(1, 0.2, -0.1);
    Primitive solid = box(Vec3::Constant(0.5));
    solid.center = Vec3(0.75, 0.45, 0.15);  // x -> y, y -> -x
    const LevelSet fromFile = make(bodyOf(mesh));
    expectLevelSet(fromFile);
    EXPECT_LT(difference(make(bodyOf(solid)), fromFile, kMeshBand), 1e-3 * kDx);

    scene::Body cutMesh = bodyOf(mesh), cutSolid = bodyOf(solid);
    for (scene::Body* body : {&cutMesh, &cutSolid}) {
        body->cut.push_back(sphere(0.15, {0.75, 0.45, 0.15}));  // wholly within: the mesh has no leaves there
        body->add.push_back(sphere(0.2, {1.2, 0.45, 0.15}));
    }
    EXPECT_LT(difference(make(cutSolid), make(cutMesh), kMeshBand), 1e-3 * kDx);
    EXPECT_NEAR(volume(make(cutMesh)), 0.125 + 4. / 3 * pi * (0.008 - 0.15 * 0.15 * 0.15), 0.03 * 0.125);
}

TEST_F(BodyLevelSet, BadBodiesAreNamed)
{
    scene::MeshFile mesh;
    mesh.file = write("open.obj", cubeObj(""));
    std::string said = complaint<InputError>(bodyOf(mesh));
    EXPECT_NE(said.find("4 open edges"), std::string::npos) << said;
    EXPECT_NE(said.find("scene.toml:7:1"), std::string::npos) << said;
    mesh.file = write("nan.obj", "v 0 nan 0\n" + cubeObj());
    EXPECT_NE(complaint<InputError>(bodyOf(mesh)).find("nan.obj:1"), std::string::npos);
    mesh.file = write("range.obj", cubeObj("f 2 4 8 9\n"));
    said = complaint<InputError>(bodyOf(mesh));
    EXPECT_NE(said.find("range.obj:14"), std::string::npos) << said;
    EXPECT_NE(said.find("scene.toml:7:1: body 'thing': "), std::string::npos) << said;
    mesh.file = write("large.obj", "v 0 1e39 0\n" + cubeObj());
    EXPECT_NE(complaint<InputError>(bodyOf(mesh)).find("'1e39' is too large"), std::string::npos);
    mesh.file = folder_ / "none.obj";
    EXPECT_NE(complaint<FileError>(bodyOf(mesh)), "");
    mesh.file = write("cube.obj", cubeObj());
    EXPECT_NE(complaint<InputError>(bodyOf(mesh), 1e-5).find("voxel size 1e-05 m"), std::string::npos);
    mesh.translate = Vec3::Constant(1e6);
    EXPECT_NE(complaint<InputError>(bodyOf(mesh)).find("voxels from the origin"), std::string::npos);
    mesh.scale = 1e200;
    EXPECT_NE(complaint<InputError>(bodyOf(mesh)), "");
    mesh.scale = 1e300;
    mesh.translate = Vec3::Constant(1e308);
    EXPECT_NE(complaint<InputError>(bodyOf(mesh)), "");

    EXPECT_NE(complaint<InputError>(bodyOf(sphere(0.001))).find("voxels long"), std::string::npos);
    scene::Body gone = bodyOf(sphere(0.2));
    gone.cut.push_back(sphere(0.5));
    EXPECT_NE(complaint<InputError>(gone).find("empty"), std::string::npos);
    Primitive half;
    half.kind = Primitive::Kind::halfspace;
    EXPECT_NE(complaint<InputError>(bodyOf(half)).find("unbounded"), std::string::npos);
    EXPECT_THROW(makeLevelSet(bodyOf(sphere(0.5)), gridOf(1e-3), 1000000), LimitError);
    EXPECT_THROW(makeLevelSet(bodyOf(mesh), gridOf(0), kPlenty), InputError);
    scene::MeshFile fine;
    fine.file = folder_ / "cube.obj";
    EXPECT_THROW(makeLevelSet(bodyOf(fine), gridOf(1e-4), 1000000000), LimitError);
}

}  // namespace
