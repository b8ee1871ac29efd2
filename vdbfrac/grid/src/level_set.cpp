#include "openvdb_access.h"

#include <openvdb/io/DelayedLoadMetadata.h>

#include <utility>

namespace vdbfrac::grid {

namespace {

constexpr float kDefaultHalfWidth = 3;  // voxels

}  // namespace

void initializeOpenVdb()
{
    // openvdb::initialize registers the types that files can name. Grids in memory do not need it.
    // The table for loading leaves late is taken out again: it is not used here, and the library believes the lengths
    // in it.
    static const bool done = [] {
        openvdb::initialize();
        openvdb::Metadata::unregisterType(openvdb::io::DelayedLoadMetadata::staticTypeName());
        return true;
    }();
    (void)done;
}

openvdb::FloatGrid::Ptr makeLevelSetGrid(double voxelSize, double halfWidth)
{
    auto grid = openvdb::FloatGrid::create(float(halfWidth * voxelSize));
    grid->setTransform(openvdb::math::Transform::createLinearTransform(voxelSize));
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    return grid;
}

openvdb::CoordBBox materialVoxels(const openvdb::FloatGrid& phi)
{
    openvdb::CoordBBox box;
    for (auto it = phi.cbeginValueAll(); it; ++it)
        if (*it < 0) box.expand(it.getBoundingBox());
    return box;
}

LevelSet wrap(openvdb::FloatGrid::Ptr grid)
{
    return LevelSet(std::make_unique<LevelSetGrid>(LevelSetGrid{std::move(grid)}));
}

LevelSet::LevelSet() : grid_(std::make_unique<LevelSetGrid>(LevelSetGrid{makeLevelSetGrid(1, kDefaultHalfWidth)})) {}
LevelSet::LevelSet(std::unique_ptr<LevelSetGrid> grid) : grid_(std::move(grid)) {}
LevelSet::LevelSet(LevelSet&&) noexcept = default;
LevelSet& LevelSet::operator=(LevelSet&&) noexcept = default;
LevelSet::~LevelSet() = default;

double LevelSet::voxelSize() const { return grid_->grid->voxelSize()[0]; }
double LevelSet::background() const { return grid_->grid->background(); }
std::size_t LevelSet::activeVoxels() const { return grid_->grid->activeVoxelCount(); }
LevelSet LevelSet::copy() const { return wrap(grid_->grid->deepCopy()); }

}  // namespace vdbfrac::grid
