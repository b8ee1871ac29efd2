#include "skin_topology.h"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace vdbfrac::skin {

namespace {

void joinPoints(std::span<const Vec3> points, SkinTopology& topology)
{
    std::vector<std::uint32_t> order(points.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        const Vec3 &p = points[a], &q = points[b];
        for (int k = 0; k < 3; ++k)
            if (p[k] != q[k]) return p[k] < q[k];
        return a < b;
    });
    std::vector<std::uint32_t> first(points.size());
    for (std::size_t i = 0; i < order.size(); ++i)
        first[order[i]] = i > 0 && points[order[i]] == points[order[i - 1]] ? first[order[i - 1]] : order[i];
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
    return topology;
}

}  // namespace vdbfrac::skin
