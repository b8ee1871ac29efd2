#include "skin_topology.h"

#include <vdbfrac/tetmesh/surface_input.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <tuple>

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
    struct Side {
        std::uint32_t low, high, triangle, k;
    };
    std::vector<Side> sides;
    sides.reserve(3 * topology.triangles.size());
    for (std::uint32_t t = 0; t < topology.triangles.size(); ++t)
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t a = topology.triangles[t][k], b = topology.triangles[t][(k + 1) % 3];
            sides.push_back({std::min(a, b), std::max(a, b), t, k});
        }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
        return std::tie(a.low, a.high, a.triangle, a.k) < std::tie(b.low, b.high, b.triangle, b.k);
    });
    topology.edgeOf.resize(topology.triangles.size());
    for (const Side& s : sides) {
        if (topology.edges.empty() || topology.edges.back() != std::array{s.low, s.high})
            topology.edges.push_back({s.low, s.high});
        topology.edgeOf[s.triangle][s.k] = std::uint32_t(topology.edges.size() - 1);
    }
    topology.trianglesOf = groupItems(topology.edges.size(), [&](const auto& add) {
        for (const Side& s : sides) add(topology.edgeOf[s.triangle][s.k], s.triangle);
    });
}

void findSharpEdges(SkinTopology& topology)
{
    topology.edgeNormal.assign(topology.edges.size(), Vec3::Zero());
    topology.isSharp.assign(topology.edges.size(), false);
    for (std::size_t t = 0; t < topology.triangles.size(); ++t) {
        const auto& c = topology.triangles[t];
        const Vec3 &p = topology.points[c[0]], &q = topology.points[c[1]], &r = topology.points[c[2]];
        topology.normal.push_back((q - p).cross(r - p).stableNormalized());
        for (std::uint32_t e : topology.edgeOf[t]) {
            if (topology.edgeNormal[e].isZero())
                topology.edgeNormal[e] = topology.normal[t];
            else
                topology.isSharp[e] = topology.edgeNormal[e].dot(topology.normal[t]) < kSameFace;
        }
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
