#include "body_sources.h"

#include <vdbfrac/base/primitive.h>
#include <vdbfrac/grid/vdb_file.h>

#include <openvdb/tools/LevelSetRebuild.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::grid {

namespace {

constexpr double kSameSpacing = 1e-9;  // relative; the file keeps doubles

bool isOnLattice(const ReadLevelSet& read, const scene::FilePlace& place, const scene::Grid& grid)
{
    if (place.isMoved()) return false;
    const double dx = grid.voxelSize;
    const double width = read.levelSet.background() / dx;
    return std::abs(read.levelSet.voxelSize() - dx) <= kSameSpacing * dx && read.origin.norm() <= kSameSpacing * dx &&
           std::abs(width - grid.halfWidth) <= 1e-5 * grid.halfWidth;  // the background is a float
}

/// Active voxels scale with the surface: with the square of the ratio of the voxel sizes.
double estimateBytes(const ReadLevelSet& read, double scale, const scene::Grid& grid)
{
    const double sourceWidth = 2 * read.levelSet.background() / read.levelSet.voxelSize();
    const double ratio = scale * read.levelSet.voxelSize() / grid.voxelSize;
    const double faces = double(read.levelSet.activeVoxels()) / std::max(1., sourceWidth) * ratio * ratio;
    return bytesOfBand(faces, grid.halfWidth);
}

/// Of a box with these corners that is put elsewhere.
Bounds placed(const scene::FilePlace& place, const Vec3& lower, const Vec3& upper)
{
    const Vec3 middle = place(.5 * (lower + upper)),
               reach = place.scale * place.turn.cwiseAbs() * (.5 * (upper - lower));
    return {middle - reach, middle + reach};
}

/// Files of other programs may hold values beyond their band.
void capAtBackground(openvdb::FloatGrid& grid)
{
    const float background = grid.background();
    for (auto leaf = grid.tree().beginLeaf(); leaf; ++leaf) {
        float* values = leaf->buffer().data();
        for (openvdb::Index v = 0; v < leaf->SIZE; ++v) values[v] = std::clamp(values[v], -background, background);
    }
}

}  // namespace

openvdb::FloatGrid::Ptr fromVdb(const scene::VdbFile& file, const Build& given)
{
    ReadLevelSet read = readLevelSet(file.file, file.grid, given.memoryLimit);
    openvdb::FloatGrid::Ptr source = read.levelSet.grid().grid;
    const openvdb::CoordBBox box = source->evalActiveVoxelBoundingBox();
    if (box.empty()) complain(given, file.file.string() + " holds an empty level set", "", "");
    const double from = read.levelSet.voxelSize();
    const scene::FilePlace place = scene::placeOf(file);
    const auto [lower, upper] =
        placed(place, from * fromVdb(box.min()).toVec() + read.origin, from * fromVdb(box.max()).toVec() + read.origin);
    if (!(place.scale * from >= kSmallestVoxel))
        complain(given, file.file.string() + " has voxels of " + shortNumber(place.scale * from) + " m once scaled",
                 shortNumber(kSmallestVoxel) + " m or more", "check 'scale'");
    requireReach(given, lower, upper);
    const Build build = outlined(given, lower, upper);
    if (isOnLattice(read, place, build.grid)) {
        source->setTransform(openvdb::math::Transform::createLinearTransform(build.grid.voxelSize));
        capAtBackground(*source);
        return source;
    }
    requireMemory(build, estimateBytes(read, place.scale, build.grid));
    const Mat3 turn = place.scale * place.turn;
    const Vec3 origin = place(read.origin);
    openvdb::Mat4d rows = openvdb::Mat4d::identity();  // points are rows there
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) rows[j][i] = turn(i, j);
        rows[3][i] = origin[i];
    }
    source->transform().postMult(rows);
    const auto target = openvdb::math::Transform::createLinearTransform(build.grid.voxelSize);
    auto grid = openvdb::tools::levelSetRebuild(*source, 0.f, float(build.grid.halfWidth), target.get());
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    return grid;
}

}  // namespace vdbfrac::grid
