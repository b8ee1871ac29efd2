#include "redistance.h"

#include "interpolant.h"
#include "relevel_window.h"

#include <openvdb/tools/FastSweeping.h>
#include <openvdb/tools/LevelSetTracker.h>
#include <openvdb/tools/LevelSetUtil.h>
#include <openvdb/tools/Prune.h>
#include <openvdb/tree/LeafManager.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::grid {

namespace {

using Grid = openvdb::FloatGrid;
using Leaf = Grid::TreeType::LeafNodeType;
using Mask = openvdb::MaskTree;

/// By central differences no distance is steeper than 1; above this a voxel beside the surface is set anew.
constexpr double kTooSteep = 1.05;
/// Peak bytes of a voxel that is swept: its values, the order it is swept in, the masks, and the buffers of the
/// tracker.
constexpr double kBytesPerSweptVoxel = 64;

/// Tiles are not part of a narrow band.
void deactivateTiles(Grid& grid)
{
    for (auto tile = grid.beginValueOn(); tile; ++tile)
        if (!tile.isVoxelValue()) tile.setValueOff();
}

void requireSweepMemory(const Grid& grid, int extraVoxels, const Build& build)
{
    const double width = 2 * grid.background() / voxel(grid);
    const double voxels = double(grid.activeVoxelCount()) * (1 + 2 * extraVoxels / std::max(1., width));
    requireMemory(build, double(grid.tree().memUsage()) + kBytesPerSweptVoxel * voxels);
}

bool isBeside(const Grid::ConstAccessor& phi, const openvdb::Coord& c)
{
    const bool inside = phi.getValue(c) < 0;
    for (int n = 0; n < 27; ++n)
        if ((phi.getValue(c.offsetBy(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1)) < 0) != inside) return true;
    return false;
}

/// The active voxels that have the surface between them and one of their 26 neighbours.
Mask voxelsBeside(const Grid& grid)
{
    Mask mask(grid.tree(), false, openvdb::TopologyCopy());
    openvdb::tree::LeafManager<Mask> leaves(mask);
    leaves.foreach ([&](Mask::LeafNodeType& leaf, std::size_t) {
        const auto phi = grid.getConstAccessor();
        const Leaf* values = grid.tree().probeConstLeaf(leaf.origin());
        for (auto v = values->cbeginValueOn(); v; ++v) leaf.setActiveState(v.pos(), isBeside(phi, v.getCoord()));
    });
    return mask;
}

/// Sets the values [m] of voxels beside the surface to their distances where |grad phi| is above `steep`.
void settle(Grid& grid, const Mask& beside, double steep)
{
    const Grid::ConstPtr source = grid.deepCopy();
    const double dx = voxel(grid);
    openvdb::tree::LeafManager<const Mask> leaves(beside);
    leaves.foreach ([&](const Mask::LeafNodeType& leaf, std::size_t) {
        const auto values = source->getConstAccessor();
        Interpolant phi(*source);
        Leaf& settled = *grid.tree().probeLeaf(leaf.origin());
        for (auto v = leaf.cbeginValueOn(); v; ++v) {
            const openvdb::Coord c = v.getCoord();
            if (phi.at(fromVdb(c).toVec()).gradient.norm() <= steep * dx) continue;
            settled.setValueOnly(v.pos(),
                                 std::copysign(float(dx * distanceToZero(values, phi, c)), values.getValue(c)));
        }
    });
}

/// All lengths times a power of two, which no bit but exponents notices.
void scale(Grid& grid, double by)
{
    openvdb::tree::LeafManager<Grid::TreeType> leaves(grid.tree());
    leaves.foreach ([&](Leaf& leaf, std::size_t) {
        float* const values = leaf.buffer().data();
        for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) values[i] *= float(by);
    });
    openvdb::tools::changeLevelSetBackground(grid.tree(), float(by) * grid.background());
    grid.setTransform(openvdb::math::Transform::createLinearTransform(by * voxel(grid)));
}

/// The sweeps of LevelSetTracker in all other voxels.
void sweep(Grid& grid, const Mask& beside, int halfWidth)
{
    const double by = std::exp2(std::ceil(std::log2(1 / constantsUnit(voxel(grid)))));
    const openvdb::math::Transform::Ptr own = grid.transformPtr();
    if (by > 1) scale(grid, by);
    Mask moving(grid.tree(), false, openvdb::TopologyCopy());
    moving.topologyDifference(beside);
    openvdb::tools::LevelSetTracker<Grid> tracker(grid);
    tracker.setSpatialScheme(openvdb::math::HJWENO5_BIAS);
    tracker.setTemporalScheme(openvdb::math::TVD_RK1);
    tracker.setNormCount(int(std::ceil((halfWidth + 1) / 0.3)));  // a sweep carries a distance by 0.3 voxels
    tracker.normalize(&moving);
    if (by > 1) scale(grid, 1 / by), grid.setTransform(own);
}

}  // namespace

double smallestVoxel(const Grid& grid)
{
    const openvdb::Vec3d size = grid.voxelSize();
    return std::min({size.x(), size.y(), size.z()});
}

openvdb::FloatGrid::Ptr widened(const openvdb::FloatGrid& grid, int extra, const Build& build)
{
    requireSweepMemory(grid, extra, build);
    const double reach = grid.background() + extra * voxel(grid);
    Grid::Ptr wide = openvdb::tools::dilateSdf(grid, extra, openvdb::tools::NN_FACE_EDGE_VERTEX);
    openvdb::tools::changeLevelSetBackground(wide->tree(), float(reach));
    return wide;
}

openvdb::FloatGrid::Ptr sweptBand(const openvdb::FloatGrid& source, const Build& build)
{
    requireSweepMemory(source, 1, build);
    Grid::Ptr grid = source.deepCopy();
    deactivateTiles(*grid);
    openvdb::tools::dilateActiveValues(grid->tree(), 1, openvdb::tools::NN_FACE_EDGE_VERTEX,
                                       openvdb::tools::IGNORE_TILES);
    const Mask beside = voxelsBeside(*grid);
    settle(*grid, beside, -1);
    grid->tree().topologyIntersection(beside);
    openvdb::tools::changeLevelSetBackground(grid->tree(), float(2 * voxel(*grid)));  // none is farther than sqrt(3)
    grid = widened(*grid, 2, build);
    trimBand(*grid, 3);
    return grid;
}

void polish(openvdb::FloatGrid& grid, int halfWidth)
{
    openvdb::tools::changeLevelSetBackground(grid.tree(), float((halfWidth + 2) * voxel(grid)));
    const Mask beside = voxelsBeside(grid);
    settle(grid, beside, kTooSteep);
    sweep(grid, beside, halfWidth);
}

void trimBand(openvdb::FloatGrid& grid, double halfWidth)
{
    const float background = float(halfWidth * voxel(grid));
    deactivateTiles(grid);
    openvdb::tree::LeafManager<openvdb::FloatTree> leaves(grid.tree());
    leaves.foreach ([&](Leaf& leaf, std::size_t) {
        for (auto v = leaf.beginValueOn(); v; ++v)
            if (!(std::abs(*v) < background)) v.setValueOff();
    });
    openvdb::tools::changeLevelSetBackground(grid.tree(), background);
    openvdb::tools::pruneLevelSet(grid.tree());
}

}  // namespace vdbfrac::grid
