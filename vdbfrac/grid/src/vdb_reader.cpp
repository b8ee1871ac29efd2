#include "body_sources.h"
#include "vdb_stream.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/grid/openvdb.h>

#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::grid {

namespace {

namespace fs = std::filesystem;

constexpr double kUniformTolerance = 1e-6;  // of the voxel size; the file's matrix went through products of doubles

GridInfo describe(const openvdb::GridBase& grid)
{
    const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
    GridInfo info{grid.getName(),
                  grid.valueType(),
                  openvdb::GridBase::gridClassToString(grid.getGridClass()),
                  std::int64_t(grid.activeVoxelCount()),
                  grid.voxelSize()[0],
                  fromVdb(box.min()),
                  fromVdb(box.max()),
                  {},
                  {},
                  {},
                  {}};
    if (grid.isType<openvdb::FloatGrid>()) info.background = static_cast<const openvdb::FloatGrid&>(grid).background();
    if (!box.empty()) {
        const openvdb::BBoxd world =
            grid.transform().indexToWorld(openvdb::BBoxd(box.min().asVec3d(), box.max().asVec3d()));
        info.lowerWorld = {world.min().x(), world.min().y(), world.min().z()};
        info.upperWorld = {world.max().x(), world.max().y(), world.max().z()};
    }
    for (auto entry = grid.beginMeta(); entry != grid.endMeta(); ++entry)
        info.metadata[entry->first] = entry->second->str();
    return info;
}

/// "double grid of class 'level set'".
std::string kindOf(const openvdb::GridBase& grid)
{
    return grid.valueType() + " grid of class '" + openvdb::GridBase::gridClassToString(grid.getGridClass()) + "'";
}

/// What to do with a grid that is no level set of floats.
std::string remedyFor(const openvdb::GridBase& grid)
{
    if (grid.getGridClass() == openvdb::GRID_LEVEL_SET) return "convert its values to float";
    return grid.getGridClass() == openvdb::GRID_FOG_VOLUME ? "a fog volume has to be turned into an SDF first" : "";
}

openvdb::FloatGrid::Ptr findLevelSet(const openvdb::GridPtrVec& grids, const std::string& file, const std::string& name)
{
    for (const openvdb::GridBase::Ptr& grid : grids) {
        if (!name.empty() && grid->getName() != name) continue;
        const bool isLevelSet = grid->getGridClass() == openvdb::GRID_LEVEL_SET && grid->isType<openvdb::FloatGrid>();
        if (isLevelSet) return openvdb::gridPtrCast<openvdb::FloatGrid>(grid);
        if (!name.empty())
            throw InputError({file, "grid '" + name + "' is a " + kindOf(*grid), "a float grid of class 'level set'",
                              remedyFor(*grid)});
    }
    std::string names;
    for (const openvdb::GridBase::Ptr& grid : grids)
        names += (names.empty() ? "" : ", ") + grid->getName() + " (" + kindOf(*grid) + ")";
    throw InputError({file, name.empty() ? "holds no level set" : "holds no grid '" + name + "'",
                      name.empty() ? "a float grid of class 'level set'" : "",
                      "it holds: " + (names.empty() ? "no grid of a type that is read here" : names)});
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
    if (!(dx > 0) || !std::isfinite(dx)) refuse("has voxels of size " + shortNumber(dx));
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
            if (!(std::abs(m[row][column] - (row == column ? dx : 0)) <= kUniformTolerance * dx))
                refuse("has voxels that are not cubes along the axes");
    const Vec3 origin(m[3][0], m[3][1], m[3][2]);
    if (!origin.allFinite()) refuse("has an origin that is not finite");
    return {dx, origin};
}

void requireNear(const openvdb::CoordBBox& box, const std::string& file)
{
    for (int a = 0; a < 3 && !box.empty(); ++a)
        if (box.min()[a] < -kFarthestVoxel || box.max()[a] > kFarthestVoxel)
            throw FileError(file, "is damaged: voxels impossibly far away");
}

void requireSoundTree(const openvdb::FloatGrid& grid, const std::string& file)
{
    const auto damaged = [&](const char* what) { throw FileError(file, std::string("is damaged: ") + what); };
    if (!std::isfinite(grid.background())) damaged("a background that is not finite");
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
        if (grid.tree().probeConstLeaf(leaf->origin()) != &*leaf) damaged("a leaf in a wrong place");
        for (auto value = leaf->cbeginValueAll(); value; ++value)
            if (!std::isfinite(*value)) damaged("values that are not finite");
    }
    auto tile = grid.tree().cbeginValueAll();
    tile.setMaxDepth(openvdb::FloatTree::ValueAllCIter::LEAF_DEPTH - 1);
    for (; tile; ++tile)
        if (!std::isfinite(*tile)) damaged("values that are not finite");
    requireNear(grid.evalActiveVoxelBoundingBox(), file);
}

void requireBackground(const openvdb::FloatGrid& grid, const std::string& file)
{
    if (!(grid.background() > 0)) throw FileError(file, "is damaged: a background that is not above 0");
}

/// Is a voxel beside the tile `box` outside, and not of the band? Looks at 1 to 16 places of each face.
bool touchesOutside(const openvdb::FloatGrid::ConstAccessor& phi, const openvdb::CoordBBox& box)
{
    constexpr int kLeaf = 8, kMaxProbes = 4;  // along an edge
    const int size = box.dim().x(), step = std::max(kLeaf, size / kMaxProbes);
    for (int axis = 0; axis < 3; ++axis)
        for (const int beside : {box.min()[axis] - 1, box.max()[axis] + 1})
            for (int u = step / 2; u < size; u += step)
                for (int v = step / 2; v < size; v += step) {
                    openvdb::Coord c = box.min();
                    c[axis] = beside, c[(axis + 1) % 3] += u, c[(axis + 2) % 3] += v;
                    float value = 0;
                    if (!phi.probeValue(c, value) && value > 0) return true;
                }
    return false;
}

/// The band lies between inside and outside. Where it does not, signs were lost: a tile of material that is none.
void requireBandBetween(const openvdb::FloatGrid& grid, const std::string& file)
{
    const auto phi = grid.getConstAccessor();
    auto tile = grid.tree().cbeginValueOff();
    tile.setMaxDepth(openvdb::FloatTree::ValueOffCIter::LEAF_DEPTH - 1);
    for (; tile; ++tile) {
        if (*tile >= 0) continue;
        const openvdb::CoordBBox box = tile.getBoundingBox();
        requireNear(box, file);
        if (touchesOutside(phi, box))
            throw FileError(file, "is damaged: inside and outside touch without a surface between them");
    }
}

/// The outermost voxels of a band are outside the material, so phi has to be positive there.
void requireNegativeInside(const openvdb::FloatGrid& grid, const std::string& file)
{
    const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
    const auto isOutermost = [&](const openvdb::Coord& c) {
        for (int axis = 0; axis < 3; ++axis)
            if (c[axis] == box.min()[axis] || c[axis] == box.max()[axis]) return true;
        return false;
    };
    for (auto v = grid.cbeginValueOn(); v; ++v)
        if (*v <= 0 && isOutermost(v.getCoord()))
            throw InputError({file, "grid '" + grid.getName() + "' is not positive at its outermost voxels",
                              "phi < 0 inside, > 0 outside, with the whole surface in the grid", "negate it"});
}

/// The grid that is asked for, or the first level set, or the first float grid of no class.
openvdb::FloatGrid::Ptr findSdf(const openvdb::GridPtrVec& grids, const std::string& file, const std::string& name)
{
    const auto hasClass = [&](const openvdb::GridBase::Ptr& grid, openvdb::GridClass c) {
        return grid->isType<openvdb::FloatGrid>() && grid->getGridClass() == c &&
               (name.empty() || grid->getName() == name);
    };
    for (const openvdb::GridClass c : {openvdb::GRID_LEVEL_SET, openvdb::GRID_UNKNOWN})
        for (const openvdb::GridBase::Ptr& grid : grids)
            if (hasClass(grid, c)) return openvdb::gridPtrCast<openvdb::FloatGrid>(grid);
    return findLevelSet(grids, file, name);  // complains
}

void requireInvertible(const openvdb::FloatGrid& grid, const std::string& file)
{
    const auto refuse = [&](const char* what) {
        throw InputError({file, "grid '" + grid.getName() + "' has a transform that " + what, "a linear one", ""});
    };
    if (!grid.transform().isLinear()) refuse("is not linear");
    // Throw when singular.
    const openvdb::Mat4d m = grid.transform().baseMap()->getAffineMap()->getMat4(), inverse = m.inverse();
    for (int i = 0; i < 16; ++i)
        if (!std::isfinite(m.asPointer()[i]) || !std::isfinite(inverse.asPointer()[i])) refuse("is not finite");
}

/// Grids of other programs: of no class, with tiles that are active, without a background.
void makeLevelSetLike(openvdb::FloatGrid& grid)
{
    float largest = 0;
    for (auto v = grid.cbeginValueOn(); v; ++v) largest = std::max(largest, std::abs(*v));
    if (!(grid.background() > 0)) grid.tree().root().setBackground(largest, true);
    grid.setGridClass(openvdb::GRID_LEVEL_SET);
    openvdb::tools::signedFloodFill(grid.tree());
}

/// Throws FileError or InputError. What its transform moves it by is taken out of it.
ReadLevelSet checked(openvdb::FloatGrid::Ptr grid, const std::string& file)
{
    const Placement place = placement(*grid, file);
    requireSoundTree(*grid, file);
    requireBackground(*grid, file);
    requireNegativeInside(*grid, file);
    requireBandBetween(*grid, file);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(place.voxelSize));
    return {wrap(std::move(grid)), place.origin};
}

}  // namespace

std::vector<GridInfo> describeVdb(const fs::path& file, std::uint64_t memoryLimit)
try {
    std::vector<GridInfo> infos;
    for (const openvdb::GridBase::Ptr& grid : readGrids(file, memoryLimit)) infos.push_back(describe(*grid));
    return infos;
} catch (const openvdb::Exception& e) {
    throw FileError(file.string(), std::string("is damaged: ") + e.what());
}

ReadLevelSet readLevelSet(const fs::path& file, const std::string& name, std::uint64_t memoryLimit)
try {
    return checked(findLevelSet(readGrids(file, memoryLimit), file.string(), name), file.string());
} catch (const openvdb::Exception& e) {  // a singular transform, for one
    throw FileError(file.string(), std::string("is damaged: ") + e.what());
}

ReadLevelSet fromOpenVdb(const openvdb::FloatGrid& grid, const std::string& what)
try {
    if (grid.getGridClass() != openvdb::GRID_LEVEL_SET)
        throw InputError({what, "is a " + kindOf(grid), "a float grid of class 'level set'", remedyFor(grid)});
    return checked(grid.deepCopy(), what);
} catch (const openvdb::Exception& e) {
    throw FileError(what, std::string("is damaged: ") + e.what());
}

openvdb::FloatGrid::ConstPtr toOpenVdb(const LevelSet& phi) { return phi.grid().grid; }

openvdb::FloatGrid::Ptr readSdf(const fs::path& file, const std::string& name, std::uint64_t memoryLimit)
try {
    const std::string text = file.string();
    openvdb::FloatGrid::Ptr grid = findSdf(readGrids(file, memoryLimit), text, name);
    requireSoundTree(*grid, text);
    requireInvertible(*grid, text);
    requireNegativeInside(*grid, text);
    if (grid->getGridClass() != openvdb::GRID_LEVEL_SET) {
        makeLevelSetLike(*grid);
    } else {
        requireBackground(*grid, text);
        requireBandBetween(*grid, text);
    }
    return grid;
} catch (const openvdb::Exception& e) {
    throw FileError(file.string(), std::string("is damaged: ") + e.what());
}

}  // namespace vdbfrac::grid
