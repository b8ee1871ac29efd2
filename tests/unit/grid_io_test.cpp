// Bodies as level sets, and .vdb files, sound and damaged.
#include "openvdb_access.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/body_level_set.h>
#include <vdbfrac/grid/phi_nodes.h>
#include <vdbfrac/grid/vdb_file.h>

#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

using namespace vdbfrac;
using namespace vdbfrac::grid;
namespace fs = std::filesystem;
using std::numbers::pi;

namespace {

constexpr std::uint64_t kPlenty = std::uint64_t{4} << 30;  // bytes
constexpr double kDx = 0.04;
// tools::meshToVolume leaves out voxels that are 2.8 to 3 voxels from an edge across both of its faces.
constexpr double kMeshBand = 0.9;
// tools::levelSetRebuild goes through a mesh of its own, whose creases show in the outer half of the band.
constexpr double kRebuiltBand = 0.5, kRebuilt = 0.15;  // of the band; of a voxel
// A voxel's share is taken from phi at its centre alone: second order in dx / radius of curvature.
constexpr double kVolumeTolerance = 0.01;

class GridIo : public testing::Test {
protected:
    void SetUp() override
    {
        const auto* info = testing::UnitTest::GetInstance()->current_test_info();
        folder_ = fs::temp_directory_path() / ("vdbfrac-" + std::to_string(::getpid()) + "-" + info->name());
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }

    fs::path write(const std::string& name, const std::string& content) const
    {
        writeText(folder_ / name, content);
        return folder_ / name;
    }

    fs::path folder_;
};

scene::Grid gridOf(double dx)
{
    scene::Grid grid;
    grid.voxelSize = dx;
    return grid;
}

scene::Body bodyOf(decltype(scene::Body::shape) shape)
{
    scene::Body body;
    body.name = "thing";
    body.shape = std::move(shape);
    body.place = "scene.toml:7:1";
    return body;
}

Primitive sphere(double radius, const Vec3& center = Vec3(0.013, -0.2, 0.31))
{
    Primitive p;
    p.kind = Primitive::Kind::sphere;
    p.radius = radius;
    p.center = center;
    return p;
}

Primitive box(const Vec3& size)
{
    Primitive p;
    p.size = size;
    p.center = Vec3(0.007, 0.011, -0.003);
    return p;
}

LevelSet make(const scene::Body& body, double dx = kDx) { return makeLevelSet(body, gridOf(dx), kPlenty); }

/// Volume by the share of each voxel that lies inside a plane at the distance phi.
double volume(const LevelSet& phi)
{
    const openvdb::FloatGrid& grid = *phi.grid().grid;
    const double dx = phi.voxelSize();
    openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
    const auto accessor = grid.getConstAccessor();
    double voxels = 0;
    for (auto ijk = box.begin(); ijk; ++ijk) voxels += std::clamp(0.5 - accessor.getValue(*ijk) / dx, 0., 1.);
    return voxels * dx * dx * dx;
}

/// Largest difference of two level sets where the first is nearer to its surface than `within` bands.
double difference(const LevelSet& a, const LevelSet& b, double within = 1)
{
    const auto other = b.grid().grid->getConstAccessor();
    double worst = 0;
    for (auto v = a.grid().grid->cbeginValueOn(); v; ++v)
        if (std::abs(*v) < within * a.background())
            worst = std::max(worst, std::abs(double(*v) - other.getValue(v.getCoord())));
    return worst;
}

std::string cubeObj(const std::string& lastFace = "f 2 4 8 6\n")
{
    std::string text;
    for (int i = 0; i < 8; ++i)
        text += "v " + std::to_string(i & 1) + " " + std::to_string(i >> 1 & 1) + " " + std::to_string(i >> 2) + "\n";
    return text + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\n" + lastFace;
}

template <class E>
std::string complaint(const scene::Body& body, double dx = kDx)
{
    try {
        make(body, dx);
    } catch (const E& e) {
        return e.what();
    }
    return "";
}

void expectLevelSet(const LevelSet& phi)
{
    const openvdb::FloatGrid& grid = *phi.grid().grid;
    EXPECT_EQ(grid.getGridClass(), openvdb::GRID_LEVEL_SET);
    EXPECT_TRUE(grid.transform().indexToWorld(openvdb::Vec3d(0)).eq(openvdb::Vec3d(0)));
    for (auto v = grid.cbeginValueAll(); v; ++v) EXPECT_LE(std::abs(*v), grid.background());
}

}  // namespace

TEST_F(GridIo, DefaultLevelSetIsEmpty)
{
    EXPECT_EQ(LevelSet().activeVoxels(), 0u);
    EXPECT_EQ(LevelSet().voxelSize(), 1);
    EXPECT_EQ(LevelSet().copy().background(), 3);
}

TEST_F(GridIo, SphereBoxAndTorusHaveTheirVolumes)
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

TEST_F(GridIo, EveryVoxelHoldsItsExactDistance)
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

TEST_F(GridIo, SolidsAreUnitedThenTakenAway)
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

TEST_F(GridIo, SameBitsForAnyNumberOfThreads)
{
    scene::Body body = bodyOf(box({1, 0.6, 0.8}));
    body.cut.push_back(sphere(0.3, {0.5, 0, 0}));
    const LevelSet many = make(body);
    const ThreadLimit one(1);
    const LevelSet single = make(body);
    EXPECT_EQ(many.activeVoxels(), single.activeVoxels());
    EXPECT_EQ(difference(many, single), 0);
}

TEST_F(GridIo, PartsTooFarApartForOneBoxAreALimit)
{
    constexpr std::uint64_t kLimit = 100000000;  // bytes; the box of both balls has 250^3 leafs
    scene::Body body = bodyOf(sphere(0.5));
    body.add.push_back(sphere(0.5, Vec3::Constant(100)));
    EXPECT_THROW(sampleNodes(makeLevelSet(body, gridOf(kDx), kLimit), kLimit), LimitError);
    body.add.back() = sphere(0.5, Vec3::Constant(2));
    EXPECT_NO_THROW(sampleNodes(makeLevelSet(body, gridOf(kDx), kLimit), kLimit));
}

TEST_F(GridIo, TheBoxOfNodesHoldsMaterialThatIsNotOfTheBand)
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

TEST_F(GridIo, MeshBodyEqualsTheAnalyticOne)
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
        body->cut.push_back(sphere(0.15, {0.75, 0.45, 0.15}));  // wholly within: the mesh has no leafs there
        body->add.push_back(sphere(0.2, {1.2, 0.45, 0.15}));
    }
    EXPECT_LT(difference(make(cutSolid), make(cutMesh), kMeshBand), 1e-3 * kDx);
    EXPECT_NEAR(volume(make(cutMesh)), 0.125 + 4. / 3 * pi * (0.008 - 0.15 * 0.15 * 0.15), 0.03 * 0.125);
}

TEST_F(GridIo, BadBodiesAreNamed)
{
    scene::MeshFile mesh;
    mesh.file = write("open.obj", cubeObj(""));
    std::string said = complaint<InputError>(bodyOf(mesh));
    EXPECT_NE(said.find("4 open edges"), std::string::npos) << said;
    EXPECT_NE(said.find("scene.toml:7:1"), std::string::npos) << said;
    mesh.file = write("nan.obj", "v 0 nan 0\n" + cubeObj());
    EXPECT_NE(complaint<InputError>(bodyOf(mesh)).find("nan.obj:1"), std::string::npos);
    mesh.file = write("range.obj", cubeObj("f 2 4 8 9\n"));
    EXPECT_NE(complaint<InputError>(bodyOf(mesh)).find("range.obj:14"), std::string::npos);
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

TEST_F(GridIo, VdbFileSurvivesWritingAndReading)
{
    const LevelSet phi = make(bodyOf(sphere(0.5)));
    NamedGrid level{"phi", &phi, {}, 1, "m"};
    NamedGrid energy{"energy", nullptr, {{{1, 2, 3}, {4, 5, -6}}, {1.5f, 2.5f}, {}, 0}, kDx, "J/m^3"};
    NamedGrid velocity{"vel", nullptr, {{{0, 0, 0}}, {}, {Eigen::Vector3f(1, 2, 3)}, 0, true}, kDx, "m/s"};
    const fs::path file = folder_ / "frame.0001.vdb";
    writeVdb(file, {level, energy, velocity}, {{"creator", "a test"}, {"time", 0.5}, {"frame", std::int64_t{1}}});

    const std::vector<GridInfo> infos = describeVdb(file);
    ASSERT_EQ(infos.size(), 3u);
    EXPECT_EQ(infos[0].gridClass, "level set");
    EXPECT_EQ(infos[0].activeVoxels, std::int64_t(phi.activeVoxels()));
    EXPECT_EQ(infos[1].upper, (Coord{4, 5, 3}));
    EXPECT_NEAR(infos[1].lowerWorld.z(), -6 * kDx, 1e-12);
    EXPECT_EQ(infos[1].metadata.at("units"), "J/m^3");
    EXPECT_EQ(infos[2].type, "vec3s");
    EXPECT_EQ(infos[0].background, phi.background());
    EXPECT_EQ(infos[1].background, 0);
    EXPECT_FALSE(infos[2].background);
    EXPECT_DOUBLE_EQ(infos[1].voxelSize, kDx);
    const ReadLevelSet back = readLevelSet(file, "");
    EXPECT_EQ(difference(phi, back.levelSet), 0);
    EXPECT_EQ(back.levelSet.activeVoxels(), phi.activeVoxels());
    EXPECT_THROW(readLevelSet(file, "energy"), InputError);
    EXPECT_THROW(readLevelSet(file, "none"), InputError);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator{}), 1);
    EXPECT_THROW(writeVdb(folder_ / "missing" / "x.vdb", {level}, {}), FileError);
}

TEST_F(GridIo, GridsAreRefusedByTheMemoryTheySayTheyTake)
{
    const LevelSet phi = make(bodyOf(sphere(0.5)));
    writeVdb(folder_ / "ball.vdb", {{"phi", &phi, {}, 1, ""}}, {});
    const std::uint64_t bytes = phi.grid().grid->memUsage();
    EXPECT_THROW(readLevelSet(folder_ / "ball.vdb", "", bytes / 2), LimitError);
    EXPECT_THROW(describeVdb(folder_ / "ball.vdb", bytes / 2), LimitError);
    EXPECT_NO_THROW(readLevelSet(folder_ / "ball.vdb", "", 2 * bytes));
}

TEST_F(GridIo, MoreMemoryThanAFileCanHoldIsALieAndNoLimit)
{
    const LevelSet phi = make(bodyOf(sphere(0.5)));
    writeVdb(folder_ / "ball.vdb", {{"phi", &phi, {}, 1, ""}}, {});
    std::string bytes = readText(folder_ / "ball.vdb");
    const std::string key = openvdb::GridBase::META_FILE_MEM_BYTES, type = openvdb::Int64Metadata::staticTypeName();
    // Lengths stand before type and value.
    const std::size_t place = bytes.find(key) + key.size() + 4 + type.size() + 4;
    for (const std::int64_t said : {std::int64_t(1) << 40, std::int64_t(-1)}) {
        std::memcpy(bytes.data() + place, &said, sizeof said);
        EXPECT_THROW(describeVdb(write("lie.vdb", bytes), kPlenty), FileError) << said;
    }
}

TEST_F(GridIo, VdbBodyIsTakenAsItIsOrRebuilt)
{
    const LevelSet phi = make(bodyOf(sphere(0.5)));
    writeVdb(folder_ / "ball.vdb", {{"phi", &phi, {}, 1, ""}}, {});
    const scene::Body body = bodyOf(scene::VdbFile{folder_ / "ball.vdb", "phi"});
    EXPECT_EQ(difference(phi, make(body)), 0);
    const double exact = 4. / 3 * pi * 0.125;
    const LevelSet coarse = make(body, 0.05);
    EXPECT_DOUBLE_EQ(coarse.voxelSize(), 0.05);
    EXPECT_NEAR(volume(coarse), exact, 2 * kVolumeTolerance * exact);

    LevelSet moved = phi.copy();
    moved.grid().grid->transform().postTranslate({0.01, 0.02, 0.015});
    writeVdb(folder_ / "moved.vdb", {{"phi", &moved, {}, 1, ""}}, {});
    EXPECT_NEAR(readLevelSet(folder_ / "moved.vdb", "").origin.y(), 0.02, 1e-12);
    const LevelSet rebuilt = make(bodyOf(scene::VdbFile{folder_ / "moved.vdb", ""}));
    EXPECT_LT(difference(make(bodyOf(sphere(0.5, Vec3(0.023, -0.18, 0.325)))), rebuilt, kRebuiltBand), kRebuilt * kDx);
}

TEST_F(GridIo, VdbGridsThatAreNoLevelSetsAreRefused)
{
    LevelSet phi = make(bodyOf(sphere(0.2)));
    openvdb::FloatGrid& grid = *phi.grid().grid;
    const auto refused = [&] {
        writeVdb(folder_ / "x.vdb", {{"phi", &phi, {}, 1, ""}}, {});
        EXPECT_THROW(readLevelSet(folder_ / "x.vdb", ""), Error);
    };
    const auto transform = grid.transformPtr();
    auto stretched = openvdb::math::Transform::createLinearTransform(0.1);
    stretched->preScale(openvdb::Vec3d(1, 2, 1));
    grid.setTransform(stretched);
    refused();
    grid.setTransform(transform);
    grid.setGridClass(openvdb::GRID_FOG_VOLUME);
    refused();
    grid.setGridClass(openvdb::GRID_LEVEL_SET);
    const LevelSet kept = phi.copy();
    for (auto v = grid.beginValueAll(); v; ++v) v.setValue(-*v);
    refused();
    phi = kept.copy();
    phi.grid().grid->beginValueOn().setValue(std::numeric_limits<float>::quiet_NaN());
    refused();
    for (const openvdb::Index level : {1, 2, 3}) {  // material without a surface
        phi = kept.copy();
        phi.grid().grid->tree().addTile(level, openvdb::Coord(8192), -float(phi.background()), false);
        refused();
    }
    phi = kept.copy();
    phi.grid().grid->tree().addTile(3, openvdb::Coord(std::numeric_limits<int>::max()), -float(phi.background()),
                                    false);
    refused();
}

TEST_F(GridIo, TruncatedVdbFilesAreFileErrors)
{
    const LevelSet phi = make(bodyOf(sphere(0.2)));
    writeVdb(folder_ / "ball.vdb", {{"phi", &phi, {}, 1, ""}}, {{"creator", "a test"}});
    const std::string bytes = readText(folder_ / "ball.vdb");
    for (int i = 0; i < 60; ++i) {
        const fs::path file = write("cut.vdb", bytes.substr(0, bytes.size() * std::size_t(i) / 60));
        EXPECT_THROW(readLevelSet(file, ""), FileError) << i;
    }
    EXPECT_THROW(readLevelSet(write("cut.vdb", bytes.substr(0, bytes.size() - 1)), ""), FileError);
    EXPECT_THROW(readLevelSet(write("text.vdb", std::string(200, 'x')), ""), FileError);
    EXPECT_THROW(readLevelSet(folder_, ""), FileError);
}

TEST_F(GridIo, MutatedVdbFilesNeverCrash)
{
    const LevelSet phi = make(bodyOf(sphere(0.2)));
    writeVdb(folder_ / "ball.vdb", {{"phi", &phi, {}, 1, ""}}, {{"creator", "a test"}});
    const std::string sound = readText(folder_ / "ball.vdb");
    constexpr std::size_t kHead = 1500;  // headers, metadata, transform: half of the mutations go there
    int refused = 0;
    for (unsigned seed = 0; seed < 300; ++seed) {
        std::mt19937 random(seed);
        std::string bytes = sound;
        for (int n = 1 + int(random() % 4); n > 0; --n) {
            const std::size_t reach = seed % 2 ? std::min(kHead, bytes.size()) : bytes.size();
            bytes[random() % reach] = char(random());
        }
        try {
            const ReadLevelSet read = readLevelSet(write("m.vdb", bytes), "");
            EXPECT_GT(read.levelSet.voxelSize(), 0);
        } catch (const Error&) {
            ++refused;
        }
    }
    EXPECT_GT(refused, 50);
}
