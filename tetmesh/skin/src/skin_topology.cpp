#include "skin_topology.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/surface_input.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <utility>

namespace vdbfrac::skin {

namespace {

void joinPoints(std::span<const Vec3> points, SkinTopology& topology)
{
    const std::vector<std::size_t> first = tetmesh::equalPoints(points);
    topology.pointOf.resize(points.size());
    for (std::uint32_t i = 0; i < points.size(); ++i) {
        if (first[i] == i) {
            topology.pointOf[i] = std::uint32_t(topology.points.size());
            topology.points.push_back(points[i]);
        } else {
            topology.pointOf[i] = topology.pointOf[first[i]];
        }
    }
}

void numberEdges(SkinTopology& topology)
{
    const std::size_t triangles = topology.triangles.size();
    const auto cornerOf = [&](std::size_t side) { return topology.triangles[side / 3][side % 3]; };
    const auto endsOf = [&](std::uint32_t side) {
        const std::uint32_t a = cornerOf(side), b = cornerOf(side % 3 == 2 ? side - 2 : side + 1);
        return std::pair(std::min(a, b), std::max(a, b));
    };
    // Side k of triangle t is 3 t + k: by lower point, then by upper one.
    Groups sides = groupItems(topology.points.size(), [&](const auto& add) {
        for (std::uint32_t s = 0; s < 3 * triangles; ++s) add(endsOf(s).first, s);
    });
    parallelChunks(topology.points.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t low = begin; low < end; ++low)
            std::sort(sides.item.begin() + sides.start[low], sides.item.begin() + sides.start[low + 1],
                      [&](std::uint32_t a, std::uint32_t b) {
                          return std::pair(endsOf(a).second, a) < std::pair(endsOf(b).second, b);
                      });
    });
    topology.edgeOf.resize(triangles);
    for (const std::uint32_t s : sides.item) {
        const auto [low, high] = endsOf(s);
        if (topology.edges.empty() || topology.edges.back() != std::array{low, high})
            topology.edges.push_back({low, high});
        topology.edgeOf[s / 3][s % 3] = std::uint32_t(topology.edges.size() - 1);
    }
    topology.trianglesOf = groupItems(topology.edges.size(), [&](const auto& add) {
        for (std::uint32_t s : sides.item) add(topology.edgeOf[s / 3][s % 3], s / 3);
    });
}

void findSharpEdges(SkinTopology& topology)
{
    topology.normal.resize(topology.triangles.size());
    parallelChunks(topology.triangles.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t t = begin; t < end; ++t) {
            const auto [p, q, r] = topology.corners(t);
            topology.normal[t] = (q - p).cross(r - p).stableNormalized();
        }
    });
    topology.edgeNormal.assign(topology.edges.size(), Vec3::Zero());
    topology.isSharp.assign(topology.edges.size(), false);
    for (std::size_t t = 0; t < topology.triangles.size(); ++t)
        for (std::uint32_t e : topology.edgeOf[t]) {
            if (topology.edgeNormal[e].isZero())
                topology.edgeNormal[e] = topology.normal[t];
            else if (!topology.normal[t].isZero())
                topology.isSharp[e] = topology.edgeNormal[e].dot(topology.normal[t]) < kSameFace;
        }
}

}  // namespace

SkinTopology topologyOf(std::span<const Vec3> points, std::span<const std::array<std::uint32_t, 3>> triangles)
{
    SkinTopology topology;
    joinPoints(points, topology);
    topology.triangles.reserve(triangles.size());
    for (const auto& t : triangles)
        topology.triangles.push_back({topology.pointOf[t[0]], topology.pointOf[t[1]], topology.pointOf[t[2]]});
    numberEdges(topology);
    findSharpEdges(topology);
    return topology;
}

}  // namespace vdbfrac::skin
