#include <vdbfrac/grid/level_set_surface.h>

#include "openvdb_access.h"

#include <vdbfrac/base/disjoint_sets.h>
#include <vdbfrac/base/parallel.h>

#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

namespace vdbfrac::grid {

namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;

/// Names the connected parts by size: 0 has most triangles. Parts of one size keep the order of their points.
void nameParts(tetmesh::Surface& surface)
{
    DisjointSets sets(surface.points.size());
    for (const auto& t : surface.triangles) sets.join(t[0], t[1]), sets.join(t[0], t[2]);
    std::vector<std::size_t> size(surface.points.size());
    for (const auto& t : surface.triangles) ++size[sets.find(t[0])];
    std::vector<std::uint32_t> order(size.size()), rank(size.size());
    std::iota(order.begin(), order.end(), 0u);
    std::erase_if(order, [&](std::uint32_t p) { return size[p] == 0; });
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return size[a] > size[b]; });
    for (std::uint32_t r = 0; r < order.size(); ++r) rank[order[r]] = r;
    for (const auto& t : surface.triangles) surface.fragment.push_back(rank[sets.find(t[0])]);
}

/// Cells, named by their lowest voxels, in the tiles that are all inside.
double insideTiles(const openvdb::FloatGrid& grid)
{
    double cells = 0;
    auto tile = grid.tree().cbeginValueAll();
    tile.setMaxDepth(openvdb::FloatTree::ValueAllCIter::LEAF_DEPTH - 1);
    for (; tile; ++tile)
        if (*tile < 0) cells += double(tile.getVoxelCount());
    return cells;
}

/// Strides of the axes in phi[2][2][2], the one along which phi changes most first.
std::array<int, 3> steepestFirst(const float* phi)
{
    std::array<int, 3> stride{4, 2, 1};
    const auto change = [&](int s) {
        double sum = 0;
        for (int c = 0; c < 8; ++c) sum += (c & s) != 0 ? phi[c] : -phi[c];
        return std::abs(sum);
    };
    std::iter_swap(stride.begin(),
                   std::max_element(stride.begin(), stride.end(), [&](int a, int b) { return change(a) < change(b); }));
    return stride;
}

/// How much of the cell above a voxel is inside: exact on lines along the steepest axis, where the trilinear phi is
/// linear. Points instead of lines would see planes along the axes only where they pass a point.
double shareInside(openvdb::FloatGrid::ConstUnsafeAccessor& voxels, const openvdb::Coord& c)
{
    constexpr int kSamples = 4;  // along both other axes
    float phi[2][2][2];
    openvdb::tools::BoxSampler::getValues(phi, voxels, c);
    const float* all = &phi[0][0][0];
    const auto inside = std::count_if(all, all + 8, [](float v) { return v < 0; });
    if (inside == 0 || inside == 8) return inside == 8;
    const std::array<int, 3> stride = steepestFirst(all);
    double sum = 0;
    for (int n = 0; n < kSamples * kSamples; ++n) {
        const double u = (n % kSamples + 0.5) / kSamples, v = (n / kSamples + 0.5) / kSamples;
        const auto bilinear = [&](const float* p) {
            return (1 - u) * ((1 - v) * p[0] + v * p[stride[2]]) +
                   u * ((1 - v) * p[stride[1]] + v * p[stride[1] + stride[2]]);
        };
        const double low = bilinear(all), high = bilinear(all + stride[0]);
        sum += low < 0 && high < 0 ? 1 : low < 0 ? low / (low - high) : high < 0 ? high / (high - low) : 0;
    }
    return sum / (kSamples * kSamples);
}

}  // namespace

double enclosedVolume(const LevelSet& phi)
{
    const openvdb::FloatGrid& grid = *phi.grid().grid;
    double cells = insideTiles(grid);
    std::vector<const Leaf*> leaves;
    grid.tree().getNodes(leaves);
    constexpr std::size_t kLeafChunk = 64;
    cells += orderedSum(leaves.size(), kLeafChunk, [&](std::size_t begin, std::size_t end) {
        auto voxels = grid.getConstUnsafeAccessor();
        double sum = 0;
        for (std::size_t n = begin; n < end; ++n)
            for (openvdb::Index i = 0; i < Leaf::SIZE; ++i)
                sum += shareInside(voxels, leaves[n]->offsetToGlobalCoord(i));
        return sum;
    });
    return cells * std::pow(phi.voxelSize(), 3);
}

tetmesh::Surface surfaceOf(const LevelSet& phi, double adaptivity)
{
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;
    std::vector<openvdb::Vec4I> quads;
    openvdb::tools::volumeToMesh(*phi.grid().grid, points, triangles, quads, 0., adaptivity);
    tetmesh::Surface surface;
    for (const openvdb::Vec3s& p : points) surface.points.emplace_back(p.x(), p.y(), p.z());
    // OpenVDB's polygons look inward.
    for (const openvdb::Vec3I& t : triangles) surface.triangles.push_back({t[0], t[2], t[1]});
    for (const openvdb::Vec4I& q : quads) {
        surface.triangles.push_back({q[0], q[2], q[1]});
        surface.triangles.push_back({q[0], q[3], q[2]});
    }
    surface.torn.assign(surface.triangles.size(), 0);
    nameParts(surface);
    return surface;
}

}  // namespace vdbfrac::grid
