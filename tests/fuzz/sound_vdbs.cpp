#include "sound_files.h"

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <sstream>

namespace vdbfrac::fuzz {

namespace {

std::string written(const openvdb::GridCPtrVec& grids, std::uint32_t compression)
{
    openvdb::MetaMap metadata;
    metadata.insertMeta("creator", openvdb::StringMetadata("a test"));
    metadata.insertMeta("time", openvdb::DoubleMetadata(0.5));
    std::ostringstream out;
    openvdb::io::Stream stream(out);
    stream.setCompression(compression);
    stream.write(grids, metadata);
    return out.str();
}

/// A signed distance as other programs write it: of no class, known in a whole box of turned voxels, with an active
/// tile.
openvdb::FloatGrid::Ptr denseBall()
{
    constexpr int kBox = 24;
    constexpr float kVoxel = 0.05f, kRadius = 0.45f;
    auto grid = openvdb::FloatGrid::create(0);
    grid->setName("sdf");
    for (auto c = openvdb::CoordBBox::createCube(openvdb::Coord(0), kBox).begin(); c; ++c)
        grid->tree().setValue(*c, kVoxel * float(((*c).asVec3d() - openvdb::Vec3d(kBox / 2)).length()) - kRadius);
    grid->tree().addTile(1, openvdb::Coord(8), -kRadius / 2, true);
    auto transform = openvdb::math::Transform::createLinearTransform(kVoxel);
    transform->postRotate(0.3, openvdb::math::Z_AXIS);
    grid->setTransform(transform);
    return grid;
}

}  // namespace

std::vector<std::string> soundVdbs()
{
    using namespace openvdb;
    initialize();
    // In one branch of the tree: small files.
    const auto ball = tools::createLevelSetSphere<FloatGrid>(0.25f, Vec3f(0.61f), 0.05f);
    ball->setName("phi");
    const auto half = ball->deepCopy();
    half->setName("half");
    half->setSaveFloatAsHalf(true);
    const auto velocity = Vec3SGrid::create();
    velocity->setName("vel");
    velocity->tree().setValue(openvdb::Coord(1, -2, 3), Vec3s(1, 2, 3));
    const auto tiles = DoubleGrid::create(0);
    tiles->setName("tiles");
    tiles->tree().addTile(1, openvdb::Coord(0), 1, true);
    tiles->tree().addTile(3, openvdb::Coord(0, 0, 8192), 2, false);
    const auto numbers = Int32Grid::create(-1);
    numbers->setName("numbers");
    numbers->tree().setValue(openvdb::Coord(5000, 0, -5000), 7);
    const auto shared = ball->copy();  // an instance of the first grid's tree
    shared->setName("again");
    const auto dense = denseBall();
    const auto kMask = io::COMPRESS_ACTIVE_MASK;
    return {written({ball}, io::COMPRESS_BLOSC | kMask), written({ball}, io::COMPRESS_ZIP | kMask),
            written({ball}, io::COMPRESS_NONE),
            written({ball, shared, half, velocity, tiles, numbers}, io::COMPRESS_BLOSC | kMask),
            written({dense}, io::COMPRESS_NONE | kMask)};
}

}  // namespace vdbfrac::fuzz
