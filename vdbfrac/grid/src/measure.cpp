#include "openvdb_access.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/level_set_surface.h>
#include <vdbfrac/grid/relevel.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace vdbfrac::grid {

namespace {

using Grid = openvdb::FloatGrid;
using Leaf = Grid::TreeType::LeafNodeType;

/// Sums over voxels, to be added in a fixed order.
struct Sums {
    double voxels = 0, slope = 0, square = 0;
    double least = std::numeric_limits<double>::infinity(), most = 0;

    void add(double slope_)
    {
        ++voxels;
        slope += slope_;
        square += (slope_ - 1) * (slope_ - 1);
        least = std::min(least, slope_);
        most = std::max(most, slope_);
    }
    void add(const Sums& o)
    {
        voxels += o.voxels, slope += o.slope, square += o.square;
        least = std::min(least, o.least), most = std::max(most, o.most);
    }
    GradientStatistics statistics() const
    {
        if (voxels == 0) return {};
        return {std::int64_t(voxels), slope / voxels, least, most, std::sqrt(square / voxels)};
    }
};

struct LeafSums {
    Sums beside, band;
};

/// |grad phi| at a voxel, or less than 0 where a neighbour is not in the band.
double slopeAt(const Grid::ConstAccessor& phi, const openvdb::Coord& c, double dx)
{
    double square = 0;
    for (int a = 0; a < 3; ++a) {
        openvdb::Coord step(0);
        step[a] = 1;
        float up = 0, down = 0;
        if (!phi.probeValue(c + step, up) || !phi.probeValue(c - step, down)) return -1;
        const double d = (double(up) - down) / (2 * dx);
        square += d * d;
    }
    return std::sqrt(square);
}

LeafSums sumsOf(const Leaf& leaf, const Grid::ConstAccessor& phi, double dx)
{
    LeafSums sums;
    for (auto v = leaf.cbeginValueOn(); v; ++v) {
        const double slope = slopeAt(phi, v.getCoord(), dx);
        if (slope < 0) continue;
        sums.band.add(slope);
        if (std::abs(*v) < dx) sums.beside.add(slope);
    }
    return sums;
}

double areaOf(const tetmesh::Surface& surface)
{
    double area = 0;
    for (const auto& [a, b, c] : surface.triangles)
        area += 0.5 * (surface.points[b] - surface.points[a]).cross(surface.points[c] - surface.points[a]).norm();
    return area;
}

}  // namespace

LevelSetReport measure(const LevelSet& phi)
{
    const Grid& grid = *phi.grid().grid;
    const double dx = phi.voxelSize();
    std::vector<const Leaf*> leaves;
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) leaves.push_back(&*leaf);
    std::vector<LeafSums> sums(leaves.size());
    parallelChunks(leaves.size(), 16, [&](std::size_t begin, std::size_t end) {
        const auto accessor = grid.getConstAccessor();
        for (std::size_t i = begin; i < end; ++i) sums[i] = sumsOf(*leaves[i], accessor, dx);
    });
    LeafSums all;
    for (const LeafSums& s : sums) {
        all.beside.add(s.beside);
        all.band.add(s.band);
    }
    LevelSetReport report;
    report.beside = all.beside.statistics();
    report.band = all.band.statistics();
    if (leaves.empty()) return report;
    report.volume = enclosedVolume(phi);
    report.area = areaOf(surfaceOf(phi, 0));
    return report;
}

}  // namespace vdbfrac::grid
