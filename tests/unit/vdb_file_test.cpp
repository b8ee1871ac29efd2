// .vdb files, sound and damaged.
#include "folder_test.h"
#include "grid_bodies.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/grid/openvdb.h>

#include <openvdb/io/File.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

using namespace vdbfrac;
using namespace vdbfrac::grid;
using namespace vdbfrac::test;
namespace fs = std::filesystem;
using std::numbers::pi;

namespace {

using VdbFiles = FolderTest;

TEST_F(VdbFiles, VdbFileSurvivesWritingAndReading)
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
    EXPECT_EQ(infos[2].metadata.at("vector_type"), "contravariant relative");
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

TEST_F(VdbFiles, GridsAreRefusedByTheMemoryTheySayTheyTake)
{
    const LevelSet phi = make(bodyOf(sphere(0.5)));
    writeVdb(folder_ / "ball.vdb", {{"phi", &phi, {}, 1, ""}}, {});
    const std::uint64_t bytes = phi.grid().grid->memUsage();
    EXPECT_THROW(readLevelSet(folder_ / "ball.vdb", "", bytes / 2), LimitError);
    EXPECT_THROW(describeVdb(folder_ / "ball.vdb", bytes / 2), LimitError);
    EXPECT_NO_THROW(readLevelSet(folder_ / "ball.vdb", "", 2 * bytes));
}

TEST_F(VdbFiles, MoreMemoryThanAFileCanHoldIsALieAndNoLimit)
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

TEST_F(VdbFiles, VdbBodyIsTakenAsItIsOrRebuilt)
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

TEST_F(VdbFiles, VdbBodyIsScaledTurnedAndMovedAsAMeshIs)
{
    Primitive box;
    box.center = Vec3(.1, 0, 0), box.size = Vec3(.4, .3, .2);
    const LevelSet phi = make(bodyOf(box), .5 * kDx);
    LevelSet moved = phi.copy();
    moved.grid().grid->transform().postTranslate({0.01, 0.02, 0.015});
    writeVdb(folder_ / "box.vdb", {{"phi", &moved, {}, 1, ""}}, {});
    scene::VdbFile file{folder_ / "box.vdb", "", 2, Vec3(20, -35, 70), Vec3(.1, -.2, 0)};
    const LevelSet rebuilt = make(bodyOf(file));
    Primitive expected = box;
    expected.center = rotationOf(file.rotate) * (2 * (box.center + Vec3(.01, .02, .015))) + file.translate;
    expected.size *= 2, expected.rotate = file.rotate;
    EXPECT_LT(difference(make(bodyOf(expected)), rebuilt, kRebuiltBand), 1.5 * kDx);  // at corners
    const double exact = 8 * .4 * .3 * .2;
    EXPECT_NEAR(volume(rebuilt), exact, 3 * kVolumeTolerance * exact);  // twice
}

TEST_F(VdbFiles, AGridInMemoryIsTakenAsOneOfAFileAndGivenBack)
{
    const LevelSet phi = make(bodyOf(sphere(0.2)));
    openvdb::FloatGrid::Ptr moved = toOpenVdb(phi)->deepCopy();
    moved->transform().postTranslate(openvdb::Vec3d(1, 2, 3));
    const ReadLevelSet taken = fromOpenVdb(*moved);
    EXPECT_EQ(taken.origin, Vec3(1, 2, 3));
    EXPECT_EQ(difference(taken.levelSet, phi), 0);
    EXPECT_EQ(moved->transform().indexToWorld(openvdb::Vec3d(0)), openvdb::Vec3d(1, 2, 3)) << "the host's own changed";
    EXPECT_NE(toOpenVdb(taken.levelSet), moved);
}

TEST_F(VdbFiles, VdbGridsThatAreNoLevelSetsAreRefused)
{
    LevelSet phi = make(bodyOf(sphere(0.2)));
    openvdb::FloatGrid& grid = *phi.grid().grid;
    const auto refused = [&] {
        writeVdb(folder_ / "x.vdb", {{"phi", &phi, {}, 1, ""}}, {});
        EXPECT_THROW(readLevelSet(folder_ / "x.vdb", ""), Error);
        EXPECT_THROW(fromOpenVdb(*phi.grid().grid), Error);  // as from a file
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

TEST_F(VdbFiles, SurfacesThatAreCutOffOnAnySideAreRefused)
{
    const fs::path file = folder_ / "ball.vdb";
    const LevelSet ball = make(bodyOf(sphere(0.5)));
    for (const int axis : {0, 1, 2})
        for (const int side : {-1, 1}) {
            const auto cut = toOpenVdb(ball)->deepCopy();
            for (auto v = cut->beginValueAll(); v; ++v)
                if (v.isVoxelValue() && side * v.getCoord()[axis] > 2) v.setValue(cut->background()), v.setValueOff();
            openvdb::io::File(file.string()).write(openvdb::GridCPtrVec{cut});
            try {
                readLevelSet(file, "");
                ADD_FAILURE() << "axis " << axis << ", side " << side << " was taken";
            } catch (const Error& e) {
                EXPECT_NE(std::string(e.what()).find("ball.vdb"), std::string::npos) << e.what();
            }
        }
}

TEST_F(VdbFiles, TruncatedVdbFilesAreFileErrors)
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

TEST_F(VdbFiles, MutatedVdbFilesNeverCrash)
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

}  // namespace
