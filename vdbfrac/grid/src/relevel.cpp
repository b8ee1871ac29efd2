#include "body_sources.h"
#include "interpolant.h"
#include "sample_leaves.h"
#include "vdb_stream.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/grid/relevel.h>

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

/// Beside the surface a distance has |grad phi| = 1, but at creases and where it is poorly resolved.
constexpr double kNearMean = 0.1, kNearRms = 0.25;
/// By central differences no distance is steeper than 1; above this a voxel beside the surface is set anew.
constexpr double kSameVoxel = 1e-9;  // relative; files keep doubles
constexpr double kTooSteep = 1.05;
/// Peak bytes of a voxel that is swept: its values, the order it is swept in, the masks, and the buffers of the tracker.
constexpr double kBytesPerSweptVoxel = 64;

/// Tiles are not part of a narrow band.
void deactivateTiles(Grid& grid)
{
    for (auto tile = grid.beginValueOn(); tile; ++tile)
        if (!tile.isVoxelValue()) tile.setValueOff();
}

/// What is to be made.
struct Job {
    const Build& build;  ///< grid: that of the result
    Ledger& work;
};

double smallestVoxel(const Grid& grid)
{
    const openvdb::Vec3d size = grid.voxelSize();
    return std::min({size.x(), size.y(), size.z()});
}

double voxel(const Grid& grid) { return grid.voxelSize()[0]; }

bool isUniform(const openvdb::math::Transform& transform)
{
    const openvdb::Mat4d m = transform.baseMap()->getAffineMap()->getMat4();
    constexpr double kSame = 1e-6;  // of the voxel size
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
            if (!(std::abs(m[row][column] - (row == column ? m[0][0] : 0)) <= kSame * m[0][0])) return false;
    return true;
}

void requireSweepMemory(const Grid& grid, int extraVoxels, const Job& job)
{
    const double width = 2 * grid.background() / voxel(grid);
    const double voxels = double(grid.activeVoxelCount()) * (1 + 2 * extraVoxels / std::max(1., width));
    requireMemory(job.build, double(grid.tree().memUsage()) + kBytesPerSweptVoxel * voxels);
}

/// A band of distances -> one that reaches `extra` voxels farther on both sides, by fast sweeping.
Grid::Ptr widened(const Grid& grid, int extra, const Job& job)
{
    requireSweepMemory(grid, extra, job);
    const double reach = grid.background() + extra * voxel(grid);
    Grid::Ptr wide = openvdb::tools::dilateSdf(grid, extra, openvdb::tools::NN_FACE_EDGE_VERTEX);
    openvdb::tools::changeLevelSetBackground(wide->tree(), float(reach));
    return wide;
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
    leaves.foreach([&](Mask::LeafNodeType& leaf, std::size_t) {
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
    leaves.foreach([&](const Mask::LeafNodeType& leaf, std::size_t) {
        const auto values = source->getConstAccessor();
        Interpolant phi(*source);
        Leaf& settled = *grid.tree().probeLeaf(leaf.origin());
        for (auto v = leaf.cbeginValueOn(); v; ++v) {
            const openvdb::Coord c = v.getCoord();
            if (phi.at(fromVdb(c).toVec()).gradient.norm() <= steep * dx) continue;
            settled.setValueOnly(v.pos(), std::copysign(float(dx * distanceToZero(values, phi, c)), values.getValue(c)));
        }
    });
}

/// The sweeps of LevelSetTracker, with the voxels beside the surface held.
void sweep(Grid& grid, const Mask& beside, int halfWidth)
{
    Mask moving(grid.tree(), false, openvdb::TopologyCopy());
    moving.topologyDifference(beside);
    openvdb::tools::LevelSetTracker<Grid> tracker(grid);
    tracker.setSpatialScheme(openvdb::math::HJWENO5_BIAS);
    tracker.setTemporalScheme(openvdb::math::TVD_RK1);
    tracker.setNormCount(int(std::ceil((halfWidth + 1) / 0.3)));  // a sweep carries a distance by 0.3 voxels
    tracker.normalize(&moving);
}

/// A band of 3 voxels in which only the zero of the source counts, not its slope.
Grid::Ptr sweptBand(const Grid& source, const Job& job)
{
    requireSweepMemory(source, 1, job);
    Grid::Ptr grid = source.deepCopy();
    deactivateTiles(*grid);
    openvdb::tools::dilateActiveValues(grid->tree(), 1, openvdb::tools::NN_FACE_EDGE_VERTEX, openvdb::tools::IGNORE_TILES);
    const Mask beside = voxelsBeside(*grid);
    settle(*grid, beside, -1);
    grid->tree().topologyIntersection(beside);
    openvdb::tools::changeLevelSetBackground(grid->tree(), float(2 * voxel(*grid)));  // none is farther than sqrt(3)
    grid = widened(*grid, 2, job);
    trimBand(*grid, 3);
    return grid;
}

Bounds worldBox(const Grid& grid, const openvdb::CoordBBox& box)
{
    const openvdb::BBoxd world = grid.transform().indexToWorld(openvdb::BBoxd(box.min().asVec3d(), box.max().asVec3d()));
    return {{world.min().x(), world.min().y(), world.min().z()}, {world.max().x(), world.max().y(), world.max().z()}};
}

/// Leafs of the target's lattice that come near the surface: looked for in each leaf of the source.
std::vector<openvdb::Coord> targetLeafs(const Grid& source, const Build& target)
{
    Interpolant phi(source);
    const double slack = 0.5 * smallestVoxel(source);
    const Distance distance = [&](const Vec3& X) {
        const openvdb::Vec3d at = source.worldToIndex({X.x(), X.y(), X.z()});
        return std::max(0., 0.8 * std::abs(phi.valueAt({at.x(), at.y(), at.z()})) - slack);  // it need not be a distance yet
    };
    std::vector<openvdb::Coord> origins;
    for (auto leaf = source.tree().cbeginLeaf(); leaf; ++leaf) {
        if (leaf->isEmpty()) continue;
        openvdb::CoordBBox box = leaf->getNodeBoundingBox();
        box.expand(1);
        const auto found = leafsNear(distance, leafBox(worldBox(source, box), target.grid.voxelSize), target);
        origins.insert(origins.end(), found.begin(), found.end());
    }
    std::sort(origins.begin(), origins.end());
    origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
    requireMemory(target, double(origins.size()) * kBytesPerLeaf);
    return origins;
}

/// Faces of voxels on the surface, by the voxels of its band.
double facesOf(const Grid& grid)
{
    return double(grid.activeVoxelCount()) / std::max(1., 2 * double(grid.background()) / smallestVoxel(grid));
}

/// The source's values on voxels of size dx [m]; only those that its band knows are active.
Grid::Ptr resampled(const Grid& source, double dx, const Job& job)
{
    const StageTimer timer(job.work, "resample");
    Build build = job.build;
    build.grid.voxelSize = dx;
    const Bounds reach = worldBox(source, source.evalActiveVoxelBoundingBox());
    requireReach(build, reach.lower, reach.upper);
    const double ratio = smallestVoxel(source) / dx;
    requireMemory(build, bytesOfBand(facesOf(source) * ratio * ratio, build.grid.halfWidth));
    const auto target = openvdb::math::Transform::createLinearTransform(dx);
    const double known = source.background() - smallestVoxel(source);  // stencils reach beyond the band
    Grid::Ptr grid = sampleLeafs(build.grid, targetLeafs(source, build), [&]() -> Sampler {
        return [&, phi = Interpolant(source)](const openvdb::Coord& ijk) mutable {
            const openvdb::Vec3d at = source.worldToIndex(target->indexToWorld(ijk));
            const double value = phi.valueAt({at.x(), at.y(), at.z()});
            return std::abs(value) < known ? value : std::copysign(1e30, value);
        };
    });
    if (known < grid->background()) openvdb::tools::changeLevelSetBackground(grid->tree(), float(known));
    return grid;
}

/// The same, of a band that is first made as wide as sampling needs: to beside the new surface, and a stencil.
Grid::Ptr resampledWide(Grid::Ptr grid, double dx, const Job& job)
{
    const double missing = 2 * std::max(dx / voxel(*grid), 1.) + 1 - grid->background() / voxel(*grid);
    if (missing > 1e-3) grid = widened(*grid, int(std::ceil(missing)), job);
    return resampled(*grid, dx, job);
}

Redistancing chosen(const LevelSetReport& before, Redistancing wanted)
{
    if (wanted != Redistancing::automatic) return wanted;
    const GradientStatistics& g = before.beside;
    const bool near = g.voxels > 0 && std::abs(g.mean - 1) <= kNearMean && g.rms <= kNearRms;
    return near ? Redistancing::track : Redistancing::sweep;
}

LevelSetReport measured(const Grid::Ptr& grid, const Job& job)
{
    const StageTimer timer(job.work, "measure");
    return measure(wrap(grid));
}

double longestSide(const Grid& grid)
{
    openvdb::BBoxd box;
    for (auto v = grid.cbeginValueOn(); v; ++v)
        if (*v < 0) box.expand(grid.transform().indexToWorld(v.getCoord()));
    return box.empty() ? 0 : box.extents()[box.maxExtent()];
}

/// Distances near the surface -> the whole band of the result, `grid`'s voxels beside the surface held.
Grid::Ptr completed(Grid::Ptr grid, const Job& job)
{
    const int halfWidth = job.build.grid.halfWidth;
    const StageTimer timer(job.work, "redistance");
    const double dx = voxel(*grid);
    const int missing = std::max(0, int(std::ceil(halfWidth - grid->background() / dx - 1e-3)));
    grid = widened(*grid, missing + 1, job);
    openvdb::tools::changeLevelSetBackground(grid->tree(), float((halfWidth + 2) * dx));
    const Mask beside = voxelsBeside(*grid);
    settle(*grid, beside, kTooSteep);
    sweep(*grid, beside, halfWidth);
    trimBand(*grid, halfWidth);
    return grid;
}

/// Distances to the source's surface on its own voxels, in a band no wider than what follows needs.
Grid::Ptr nearSurface(const Grid& source, Redistancing how, const Job& job)
{
    const StageTimer timer(job.work, "redistance");
    if (how == Redistancing::sweep) return sweptBand(source, job);
    Grid::Ptr grid = source.deepCopy();
    const double enough = std::max(job.build.grid.halfWidth + 1., 2 * job.build.grid.voxelSize / voxel(source) + 2);
    trimBand(*grid, std::min(enough, source.background() / voxel(source)));
    return grid;
}

Relevelled relevelGrid(Grid::Ptr source, const std::string& place, const RelevelOptions& options)
{
    Relevelled result;
    Build build{{}, options.band.memoryLimit, place, "grid '" + source->getName() + "'"};
    build.grid.halfWidth = options.band.halfWidth;
    build.grid.voxelSize = voxelSizeOf(options.band, longestSide(*source), smallestVoxel(*source));
    const Job job{build, result.work};
    const std::string name = source->getName();
    if (!isUniform(source->transform())) {
        source = resampled(*source, smallestVoxel(*source), job);
        result.resampled = true;
    }
    result.before = measured(source, job);
    result.redistancing = chosen(result.before, options.redistancing);
    Grid::Ptr grid = nearSurface(*source, result.redistancing, job);
    if (std::abs(voxel(*grid) - build.grid.voxelSize) > kSameVoxel * build.grid.voxelSize) {
        grid = resampledWide(grid, build.grid.voxelSize, job);
        result.resampled = true;
    }
    if (!grid->empty()) grid = completed(grid, job);
    if (!hasMaterial(*grid))
        complain(build, "has no inside at voxel size " + shortNumber(build.grid.voxelSize) + " m", "values below 0 inside", "");
    grid->setName(name.empty() ? "phi" : name);
    result.after = measured(grid, job);
    result.levelSet = wrap(std::move(grid));
    return result;
}

}  // namespace

void trimBand(openvdb::FloatGrid& grid, double halfWidth)
{
    const float background = float(halfWidth * voxel(grid));
    deactivateTiles(grid);
    openvdb::tree::LeafManager<openvdb::FloatTree> leaves(grid.tree());
    leaves.foreach([&](Leaf& leaf, std::size_t) {
        for (auto v = leaf.beginValueOn(); v; ++v)
            if (!(std::abs(*v) < background)) v.setValueOff();
    });
    openvdb::tools::changeLevelSetBackground(grid.tree(), background);
    openvdb::tools::pruneLevelSet(grid.tree());
}

double voxelSizeOf(const Band& band, double longest, double given)
{
    if (band.voxelSize > 0) return band.voxelSize;
    return band.across > 0 ? longest / band.across : given;
}

LevelSet surfaceLevelSet(const SurfaceSource& surface, const Band& band)
{
    Build build{{}, band.memoryLimit, surface.name, "surface"};
    build.grid.voxelSize = voxelSizeOf(band, (surface.report.upper - surface.report.lower).maxCoeff());
    const double dx = build.grid.voxelSize;
    if (!(dx > 0) || !std::isfinite(dx)) complain(build, "voxel size " + shortNumber(dx) + " m", "above 0", "");
    build.grid.halfWidth = band.halfWidth + int(std::ceil(surface.inset / dx));
    Grid::Ptr grid = fromSurface(surface.soup, surface.report, build);
    if (surface.inset > 0) {
        openvdb::tree::LeafManager<openvdb::FloatTree> leaves(grid->tree());
        leaves.foreach([&](Leaf& leaf, std::size_t) {
            for (auto v = leaf.beginValueOn(); v; ++v) v.setValue(*v + float(surface.inset));
        });
        trimBand(*grid, band.halfWidth);
    }
    if (!hasMaterial(*grid))
        complain(build, "encloses nothing at voxel size " + shortNumber(dx) + " m", "at least one voxel inside",
                 "an open sheet has no inside: give it a thickness; for thin parts take smaller voxels");
    grid->setName("phi");
    return wrap(std::move(grid));
}

Relevelled relevel(const LevelSet& source, const RelevelOptions& options)
{
    return relevelGrid(source.grid().grid, source.grid().grid->getName(), options);
}

Relevelled relevelFile(const std::filesystem::path& file, const std::string& grid, const RelevelOptions& options)
{
    Ledger reading;
    Grid::Ptr source;
    {
        const StageTimer timer(reading, "read");
        source = readSdf(file, grid, options.band.memoryLimit);
    }
    Relevelled result = relevelGrid(source, file.string(), options);
    result.work.add(reading);
    return result;
}

}  // namespace vdbfrac::grid
