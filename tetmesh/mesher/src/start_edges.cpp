#include "start_edges.h"

#include <vdbfrac/base/disjoint_sets.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <tuple>
#include <unordered_map>

namespace vdbfrac::mesher {

namespace {

constexpr double kMaxSamples = 1 << 23;
constexpr double kApartOnSmall = 0.3;  // of a component's extent: leaves a handful of edges, enough to start from

/// Points of a regular lattice over a box, numbered with x running fastest.
struct Samples {
    Vec3 lower;
    double spacing = 0;
    std::array<std::uint32_t, 3> count{};

    Samples(const Bounds& box, double wanted) : lower(box.lower), spacing(wanted)
    {
        const Vec3 extent = box.upper - box.lower;
        spacing = std::max(spacing, std::cbrt(extent.prod() / kMaxSamples));
        for (std::size_t a = 0; a < 3; ++a) count[a] = std::uint32_t(std::ceil(extent[int(a)] / spacing)) + 1;
    }
    std::size_t size() const { return std::size_t(count[0]) * count[1] * count[2]; }
    std::array<std::size_t, 3> stride() const { return {1, count[0], std::size_t(count[0]) * count[1]}; }
    std::array<std::uint32_t, 3> place(std::size_t i) const
    {
        return {std::uint32_t(i % count[0]), std::uint32_t(i / count[0] % count[1]),
                std::uint32_t(i / count[0] / count[1])};
    }
    Vec3 point(std::size_t i) const
    {
        const auto p = place(i);
        return lower + spacing * Vec3(p[0], p[1], p[2]);
    }
    bool onFace(std::size_t i) const
    {
        const auto p = place(i);
        for (std::size_t a = 0; a < 3; ++a)
            if (p[a] == 0 || p[a] + 1 == count[a]) return true;
        return false;
    }
};

/// A lattice edge between material and none, with the names of both sides' connected parts.
struct Crossing {
    std::uint32_t in = 0, out = 0;  // samples
    std::uint32_t material = 0, empty = 0;

    auto component() const { return std::tie(material, empty); }
};

std::vector<std::uint8_t> insideOf(const ImplicitSolid& solid, const Samples& samples)
{
    std::vector<std::uint8_t> inside(samples.size());
    parallelChunks(samples.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const double phi = solid.phi(samples.point(i));
            if (!std::isfinite(phi)) throw InputError({"Delaunay mesh", "phi is not finite inside the box", "", ""});
            inside[i] = phi < 0;
            if (inside[i] && samples.onFace(i))
                throw InputError({"Delaunay mesh", "the solid reaches the faces of its box", "phi > 0 on them",
                                  "give a larger box"});
        }
    });
    return inside;
}

/// Calls visit(i, j) for each edge of the lattice.
template <class Visit>
void forEachEdge(const Samples& samples, const Visit& visit)
{
    const auto stride = samples.stride();
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const auto p = samples.place(i);
        for (std::size_t a = 0; a < 3; ++a)
            if (p[a] + 1 < samples.count[a]) visit(std::uint32_t(i), std::uint32_t(i + stride[a]));
    }
}

/// All crossings, those of each component of the surface together.
std::vector<Crossing> findCrossings(const Samples& samples, const std::vector<std::uint8_t>& inside)
{
    DisjointSets sets(samples.size());
    forEachEdge(samples, [&](std::uint32_t i, std::uint32_t j) {
        if (inside[i] == inside[j]) sets.join(i, j);
    });
    std::vector<Crossing> crossings;
    forEachEdge(samples, [&](std::uint32_t i, std::uint32_t j) {
        if (inside[i] == inside[j]) return;
        if (!inside[i]) std::swap(i, j);
        crossings.push_back({i, j, sets.find(i), sets.find(j)});
    });
    std::stable_sort(crossings.begin(), crossings.end(),
                     [](const Crossing& a, const Crossing& b) { return a.component() < b.component(); });
    return crossings;
}

double extentOf(const Samples& samples, std::span<const Crossing> component)
{
    Bounds box{samples.point(component[0].in), samples.point(component[0].in)};
    for (const Crossing& c : component)
        for (const Vec3& p : {samples.point(c.in), samples.point(c.out)})
            box = {box.lower.cwiseMin(p), box.upper.cwiseMax(p)};
    return (box.upper - box.lower).norm();
}

/// Appends edges whose middles are no nearer than `apart` to each other: the first that has room, again and again.
void thin(const Samples& samples, std::span<const Crossing> component, double apart, std::vector<SurfaceEdge>& edges)
{
    std::unordered_map<std::int64_t, std::vector<Vec3>> taken;  // by bucket of edge `apart`; never walked
    const auto bucket = [&](const Vec3& p, int dx, int dy, int dz) {
        const Vec3 q = (p - samples.lower) / apart;
        return ((std::int64_t(q.z()) + 1 + dz) << 42) + ((std::int64_t(q.y()) + 1 + dy) << 21) + std::int64_t(q.x()) +
               1 + dx;
    };
    const auto hasRoom = [&](const Vec3& p) {
        for (int n = 0; n < 27; ++n)
            if (const auto it = taken.find(bucket(p, n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1)); it != taken.end())
                for (const Vec3& q : it->second)
                    if ((p - q).norm() < apart) return false;
        return true;
    };
    for (const Crossing& c : component) {
        const SurfaceEdge edge{samples.point(c.in), samples.point(c.out)};
        const Vec3 middle = 0.5 * (edge.inside + edge.outside);
        if (!hasRoom(middle)) continue;
        taken[bucket(middle, 0, 0, 0)].push_back(middle);
        edges.push_back(edge);
    }
}

}  // namespace

std::vector<SurfaceEdge> startEdges(const ImplicitSolid& solid, double spacing, double apart)
{
    const Samples samples(solid.box, spacing);
    const std::vector<Crossing> crossings = findCrossings(samples, insideOf(solid, samples));
    std::vector<SurfaceEdge> edges;
    for (auto begin = crossings.begin(); begin != crossings.end();) {
        const auto end = std::find_if(begin, crossings.end(),
                                      [&](const Crossing& c) { return c.component() != begin->component(); });
        const std::span<const Crossing> component(begin, end);
        thin(samples, component, std::min(apart, kApartOnSmall * extentOf(samples, component)), edges);
        begin = end;
    }
    if (edges.empty())
        throw InputError({"Delaunay mesh", "no material found in the box",
                          "parts wider than half of the surface's triangles", "make the triangles smaller"});
    return edges;
}

}  // namespace vdbfrac::mesher
