#include <vdbfrac/grid/level_set_surface.h>

#include "openvdb_access.h"

#include <vdbfrac/base/disjoint_sets.h>

#include <openvdb/tools/LevelSetMeasure.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <algorithm>
#include <numeric>
#include <vector>

namespace vdbfrac::grid {

namespace {

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

}  // namespace

double enclosedVolume(const LevelSet& phi) { return openvdb::tools::levelSetVolume(*phi.grid().grid); }

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
