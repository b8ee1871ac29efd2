#include "vdb_stream.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/grid/vdb_file.h>

#include <openvdb/io/File.h>

#include <cassert>
#include <cmath>

namespace vdbfrac::grid {

namespace {

namespace fs = std::filesystem;

constexpr double kFarthestVoxel = 1 << 23;      // as for bodies: well inside 32 bits
constexpr double kUniformTolerance = 1e-6;      // of the voxel size; the file's matrix went through products of doubles

void insert(openvdb::MetaMap& map, const Metadata& metadata)
{
    for (const auto& [key, value] : metadata) {
        if (const auto* text = std::get_if<std::string>(&value))
            map.insertMeta(key, openvdb::StringMetadata(*text));
        else if (const auto* real = std::get_if<double>(&value))
            map.insertMeta(key, openvdb::DoubleMetadata(*real));
        else
            map.insertMeta(key, openvdb::Int64Metadata(std::get<std::int64_t>(value)));
    }
}

template <class GridType, class Value>
openvdb::GridBase::Ptr fill(const VoxelValues& values, const Value& background)
{
    auto grid = GridType::create(background);
    auto accessor = grid->getAccessor();
    for (std::size_t i = 0; i < values.coords.size(); ++i) {
        if constexpr (std::is_same_v<Value, float>) {
            accessor.setValue(toVdb(values.coords[i]), values.scalars[i]);
        } else {
            const Eigen::Vector3f& v = values.vectors[i];
            accessor.setValue(toVdb(values.coords[i]), Value(v.x(), v.y(), v.z()));
        }
    }
    return grid;
}

openvdb::GridBase::Ptr fromValues(const VoxelValues& values, double voxelSize)
{
    const bool vectors = values.isVector;
    assert(values.coords.size() == (vectors ? values.vectors.size() : values.scalars.size()));
    openvdb::GridBase::Ptr grid = vectors
                                      ? fill<openvdb::Vec3SGrid>(values, openvdb::Vec3s(values.background))
                                      : fill<openvdb::FloatGrid>(values, values.background);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(voxelSize));
    return grid;
}

openvdb::GridBase::ConstPtr toGrid(const NamedGrid& named, const Metadata& metadata)
{
    openvdb::GridBase::Ptr grid = named.levelSet
                                      ? named.levelSet->grid().grid->copy()  // shares the tree
                                      : fromValues(named.values, named.voxelSize);
    grid->setName(named.name);
    insert(*grid, metadata);
    if (!named.unit.empty()) grid->insertMeta("units", openvdb::StringMetadata(named.unit));
    return grid;
}

/// io::File::write returns normally on a full disk, so the temporary is read back.
void verify(const fs::path& temporary, const openvdb::GridCPtrVec& written)
{
    const openvdb::GridPtrVec found = readGrids(temporary);
    bool same = found.size() == written.size();
    for (std::size_t i = 0; same && i < found.size(); ++i)
        same = found[i]->getName() == written[i]->getName() &&
               found[i]->activeVoxelCount() == written[i]->activeVoxelCount() &&
               found[i]->evalActiveVoxelBoundingBox() == written[i]->evalActiveVoxelBoundingBox();
    if (!same) throw Error("what was read back differs from what was written");
}

GridInfo describe(const openvdb::GridBase& grid)
{
    const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
    return {grid.getName(),  grid.valueType(),      openvdb::GridBase::gridClassToString(grid.getGridClass()),
            std::int64_t(grid.activeVoxelCount()), grid.voxelSize()[0], fromVdb(box.min()), fromVdb(box.max())};
}

openvdb::FloatGrid::Ptr findLevelSet(const openvdb::GridPtrVec& grids, const std::string& file, const std::string& name)
{
    for (const openvdb::GridBase::Ptr& grid : grids) {
        if (!name.empty() && grid->getName() != name) continue;
        const bool isLevelSet = grid->getGridClass() == openvdb::GRID_LEVEL_SET && grid->isType<openvdb::FloatGrid>();
        if (isLevelSet) return openvdb::gridPtrCast<openvdb::FloatGrid>(grid);
        if (!name.empty())
            throw InputError({file, "grid '" + name + "' is a " + grid->valueType() + " grid of class '" +
                                        openvdb::GridBase::gridClassToString(grid->getGridClass()) + "'",
                              "a float grid of class 'level set'", "a fog volume has to be turned into an SDF first"});
    }
    std::string names;
    for (const openvdb::GridBase::Ptr& grid : grids) names += (names.empty() ? "" : ", ") + grid->getName();
    throw InputError({file, name.empty() ? "holds no level set" : "holds no grid '" + name + "'", "",
                      "it holds: " + (names.empty() ? "nothing" : names)});
}

/// Spacing and origin of a transform that is nothing but both.
struct Placement {
    double voxelSize;
    Vec3 origin;
};

Placement placement(const openvdb::FloatGrid& grid, const std::string& file)
{
    const auto refuse = [&](const std::string& what) {
        throw InputError({file, "grid '" + grid.getName() + "' " + what,
                          "one voxel size > 0 along x, y and z, no rotation",
                          "resample it in the program it comes from"});
    };
    if (!grid.transform().isLinear()) refuse("has a transform that is not linear");
    const openvdb::Mat4d m = grid.transform().baseMap()->getAffineMap()->getMat4();
    const double dx = m[0][0];
    if (!(dx > 0) || !std::isfinite(dx)) refuse("has voxels of size " + std::to_string(dx));
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
            if (!(std::abs(m[row][column] - (row == column ? dx : 0)) <= kUniformTolerance * dx))
                refuse("has voxels that are not cubes along the axes");
    const Vec3 origin(m[3][0], m[3][1], m[3][2]);
    if (!origin.allFinite()) refuse("has an origin that is not finite");
    return {dx, origin};
}

void requireSoundTree(const openvdb::FloatGrid& grid, const std::string& file)
{
    const auto damaged = [&](const char* what) { throw FileError(file, std::string("is damaged: ") + what); };
    if (!(grid.background() > 0) || !std::isfinite(grid.background())) damaged("a background that is not above 0");
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
        if (grid.tree().probeConstLeaf(leaf->origin()) != &*leaf) damaged("a leaf in a wrong place");
        for (auto value = leaf->cbeginValueAll(); value; ++value)
            if (!std::isfinite(*value)) damaged("values that are not finite");
    }
    auto tile = grid.tree().cbeginValueAll();
    tile.setMaxDepth(openvdb::FloatTree::ValueAllCIter::LEAF_DEPTH - 1);
    for (; tile; ++tile)
        if (!std::isfinite(*tile)) damaged("values that are not finite");
    const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
    for (int a = 0; a < 3 && !box.empty(); ++a)
        if (box.min()[a] < -kFarthestVoxel || box.max()[a] > kFarthestVoxel) damaged("voxels impossibly far away");
}

/// The outermost voxels of a band are outside the material, so phi has to be positive there.
void requireNegativeInside(const openvdb::FloatGrid& grid, const std::string& file)
{
    const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
    for (auto v = grid.cbeginValueOn(); v; ++v)
        if (v.getCoord().x() == box.min().x() && *v <= 0)
            throw InputError({file, "grid '" + grid.getName() + "' is not positive at its outermost voxels",
                              "phi < 0 inside, > 0 outside, with the whole surface in the grid", "negate it"});
}

}  // namespace

void writeVdb(const fs::path& file, const std::vector<NamedGrid>& grids, const Metadata& metadata)
{
    initializeOpenVdb();
    openvdb::GridCPtrVec all;
    for (const NamedGrid& grid : grids) all.push_back(toGrid(grid, metadata));
    openvdb::MetaMap fileMetadata;
    insert(fileMetadata, metadata);
    const auto write = [&](const fs::path& temporary) {
        openvdb::io::File out(temporary.string());
        const bool blosc = openvdb::io::Archive::hasBloscCompression();
        out.setCompression(openvdb::io::COMPRESS_ACTIVE_MASK |
                           (blosc ? openvdb::io::COMPRESS_BLOSC : openvdb::io::COMPRESS_ZIP));
        out.write(all, fileMetadata);
        out.close();
    };
    writeAtomically(file, write, [&](const fs::path& temporary) { verify(temporary, all); });
}

std::vector<GridInfo> describeVdb(const fs::path& file)
try {
    std::vector<GridInfo> infos;
    for (const openvdb::GridBase::Ptr& grid : readGrids(file)) infos.push_back(describe(*grid));
    return infos;
} catch (const openvdb::Exception& e) {
    throw FileError(file.string(), std::string("is damaged: ") + e.what());
}

ReadLevelSet readLevelSet(const fs::path& file, const std::string& name)
try {
    const std::string text = file.string();
    openvdb::FloatGrid::Ptr grid = findLevelSet(readGrids(file), text, name);
    const Placement place = placement(*grid, text);
    requireSoundTree(*grid, text);
    requireNegativeInside(*grid, text);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(place.voxelSize));
    return {wrap(std::move(grid)), place.origin};
} catch (const openvdb::Exception& e) {  // a singular transform, for one
    throw FileError(file.string(), std::string("is damaged: ") + e.what());
}

}  // namespace vdbfrac::grid
