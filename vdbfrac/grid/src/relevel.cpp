#include "interpolant.h"
#include "redistance.h"
#include "sample_leaves.h"
#include "vdb_stream.h"

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/grid/relevel.h>

#include <openvdb/tools/LevelSetUtil.h>
#include <openvdb/tree/LeafManager.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::grid {

namespace {

using Grid = openvdb::FloatGrid;
using Leaf = Grid::TreeType::LeafNodeType;

/// Beside the surface a distance has |grad phi| = 1, but at creases and where it is poorly resolved.
constexpr double kNearMean = 0.1, kNearRms = 0.25;
/// A wrap of a sheet has the volume inset * area.
constexpr double kSkin = 1.5;
constexpr double kSameVoxel = 1e-9;  // relative; files keep doubles

/// What is to be made.
struct Job {
    const Build& build;  ///< grid: that of the result
    Ledger& work;
};

bool isUniform(const openvdb::math::Transform& transform)
{
    const openvdb::Mat4d m = transform.baseMap()->getAffineMap()->getMat4();
    constexpr double kSame = 1e-6;  // of the voxel size
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
            if (!(std::abs(m[row][column] - (row == column ? m[0][0] : 0)) <= kSame * m[0][0])) return false;
    return true;
}

Bounds worldBox(const Grid& grid, const openvdb::CoordBBox& box)
{
    const openvdb::BBoxd world =
        grid.transform().indexToWorld(openvdb::BBoxd(box.min().asVec3d(), box.max().asVec3d()));
    return {{world.min().x(), world.min().y(), world.min().z()}, {world.max().x(), world.max().y(), world.max().z()}};
}

/// Leaves of the target's lattice that come near the surface: looked for in each leaf of the source.
std::vector<openvdb::Coord> targetLeaves(const Grid& source, const Build& target)
{
    Interpolant phi(source);
    const double slack = 0.5 * smallestVoxel(source);
    const Distance distance = [&](const Vec3& X) {
        const openvdb::Vec3d at = source.worldToIndex({X.x(), X.y(), X.z()});
        // It need not be a distance yet.
        return std::max(0., 0.8 * std::abs(phi.valueAt({at.x(), at.y(), at.z()})) - slack);
    };
    std::vector<openvdb::Coord> origins;
    for (auto leaf = source.tree().cbeginLeaf(); leaf; ++leaf) {
        if (leaf->isEmpty()) continue;
        openvdb::CoordBBox box = leaf->getNodeBoundingBox();
        box.expand(1);
        const auto found = leavesNear(distance, leafBox(worldBox(source, box), target.grid.voxelSize), target);
        origins.insert(origins.end(), found.begin(), found.end());
    }
    sortUnique(origins);
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
    requireVoxelSize(build);
    const Bounds reach = worldBox(source, source.evalActiveVoxelBoundingBox());
    requireReach(build, reach.lower, reach.upper);
    const double ratio = smallestVoxel(source) / dx;
    requireMemory(build, bytesOfBand(facesOf(source) * ratio * ratio, build.grid.halfWidth));
    const auto target = openvdb::math::Transform::createLinearTransform(dx);
    const double known = source.background() - smallestVoxel(source);  // stencils reach beyond the band
    if (!(known > 0))
        complain(build,
                 "has a band of " + shortNumber(source.background() / smallestVoxel(source)) +
                     " voxels, too narrow to be sampled",
                 "more than one voxel on either side of the surface", "");
    Grid::Ptr grid = sampleLeaves(build.grid, targetLeaves(source, build), [&]() -> Sampler {
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
    if (missing > 1e-3) grid = widened(*grid, int(std::ceil(missing)), job.build);
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
    grid = widened(*grid, missing + 1, job.build);
    polish(*grid, halfWidth);
    trimBand(*grid, halfWidth);
    return grid;
}

/// Distances to the source's surface on its own voxels, in a band no wider than what follows needs.
Grid::Ptr nearSurface(const Grid& source, Redistancing how, const Job& job)
{
    const StageTimer timer(job.work, "redistance");
    if (how == Redistancing::sweep) return sweptBand(source, job.build);
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
    requireVoxelSize(build);
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
        complain(build, "has no inside at voxel size " + shortNumber(build.grid.voxelSize) + " m",
                 "values below 0 inside", "");
    grid->setName(name.empty() ? "phi" : name);
    result.after = measured(grid, job);
    result.levelSet = wrap(std::move(grid));
    return result;
}

}  // namespace

double voxelSizeOf(const Band& band, double longest, double given)
{
    constexpr int kNarrowest = 2, kWidest = 100;  // voxels
    if (band.halfWidth < kNarrowest || band.halfWidth > kWidest)
        throw InputError({"half width of the band", std::to_string(band.halfWidth) + " voxels",
                          std::to_string(kNarrowest) + " to " + std::to_string(kWidest), ""});
    if (band.voxelSize > 0) return band.voxelSize;
    return band.across > 0 ? longest / band.across : given;
}

LevelSet surfaceLevelSet(const SurfaceSource& surface, const Band& band, std::int64_t* gaps)
{
    Build build{{}, band.memoryLimit, surface.name, "surface"};
    build.grid.voxelSize = voxelSizeOf(band, (surface.report.upper - surface.report.lower).maxCoeff());
    const double dx = build.grid.voxelSize;
    requireVoxelSize(build);
    if (surface.inset > 0 && surface.report.volume < kSkin * surface.inset * surface.report.area)
        complain(build, "encloses nothing", "a solid", "an open sheet has no inside: give it a thickness");
    build.grid.halfWidth = band.halfWidth + int(std::ceil(surface.inset / dx));
    const SurfaceGrid made = fromSurface(surface.soup, surface.report, build);
    const Grid::Ptr& grid = made.phi;
    if (gaps) *gaps = made.gaps;
    if (surface.inset > 0) {
        openvdb::tree::LeafManager<openvdb::FloatTree> leaves(grid->tree());
        leaves.foreach ([&](Leaf& leaf, std::size_t) {
            for (auto v = leaf.beginValueOn(); v; ++v) v.setValue(*v + float(surface.inset));
        });
        trimBand(*grid, band.halfWidth);
    }
    if (!hasMaterial(*grid))
        complain(build, "encloses nothing at voxel size " + shortNumber(dx) + " m", "at least one voxel inside",
                 "an open sheet has no inside: give it a thickness; for thin parts take smaller voxels");
    grid->setName("phi");
    return wrap(grid);
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
