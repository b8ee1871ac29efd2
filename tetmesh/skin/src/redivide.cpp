#include "redivide.h"

#include "fitted_parts.h"

#include <vdbfrac/base/disjoint_sets.h>
#include <vdbfrac/base/grouping.h>
#include <vdbfrac/tetmesh/planar.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cstdint>
#include <utility>

namespace vdbfrac::skin {

using tetmesh::NamedPolygon;
using tetmesh::PlanarPolygon;
using tetmesh::PlanarTriangles;
using tetmesh::triangulate;

namespace {

class Redivider {
public:
    Redivider(const SkinTopology& skin, std::span<const SkinCut::Point> points, std::vector<SkinCut::Part>& parts)
        : skin_(skin), points_(points), parts_(parts)
    {
    }
    void run()
    {
        const std::vector<SkinCut::Part> parts = std::move(parts_);
        parts_.clear();
        for (std::size_t begin = 0, end = 0; begin < parts.size(); begin = end) {
            while (end < parts.size() && parts[end].triangle == parts[begin].triangle) ++end;
            for (const auto& piece : piecesOf({parts.data() + begin, parts.data() + end})) redivide(piece);
        }
    }

private:
    using Parts = std::vector<SkinCut::Part>;

    using Edge = std::pair<std::uint32_t, std::uint32_t>;

    /// Parts that hang together by edges, by their first.
    static std::vector<Parts> piecesOf(std::span<const SkinCut::Part> parts)
    {
        std::vector<std::pair<Edge, std::uint32_t>> edges;
        for (std::uint32_t i = 0; i < parts.size(); ++i)
            for (std::size_t k = 0; k < 3; ++k)
                edges.emplace_back(std::minmax(parts[i].corner[k], parts[i].corner[(k + 1) % 3]), i);
        std::sort(edges.begin(), edges.end());
        DisjointSets sets(parts.size());
        for (std::size_t e = 1; e < edges.size(); ++e)
            if (edges[e].first == edges[e - 1].first) sets.join(edges[e].second, edges[e - 1].second);
        const std::vector<std::uint32_t> first = std::move(sets).names();
        std::vector<Parts> ofFirst(parts.size());
        for (std::size_t i = 0; i < parts.size(); ++i) ofFirst[first[i]].push_back(parts[i]);
        std::erase_if(ofFirst, [](const Parts& piece) { return piece.empty(); });
        return ofFirst;
    }

    void redivide(const Parts& piece)
    {
        if (piece.size() == 1) return parts_.push_back(piece[0]);
        const auto& t = skin_.triangles[piece[0].triangle];
        const Vec3 normal = (skin_.points[t[1]] - skin_.points[t[0]]).cross(skin_.points[t[2]] - skin_.points[t[0]]);
        NamedPolygon<std::uint32_t> named(normal);
        const auto numberOf = [&](std::uint32_t point) { return named.number(point, placeOf(skin_, points_, point)); };
        PlanarPolygon& polygon = named.polygon;
        for (const auto& [a, b] : borderOf(piece)) {
            polygon.outline.push_back({numberOf(a), numberOf(b)});
            polygon.label.push_back(0);
        }
        const PlanarTriangles divided = triangulate(polygon);
        Parts now;
        for (const auto& d : divided.triangles) now.push_back({piece[0].triangle, named.names(d)});
        // Where the border crosses itself the division stays as it was.
        const Parts& kept = divided.isSound && borderOf(now) == borderOf(piece) ? now : piece;
        parts_.insert(parts_.end(), kept.begin(), kept.end());
    }
    /// Directed edges of one part only, sorted.
    static std::vector<Edge> borderOf(const Parts& piece)
    {
        std::vector<Edge> all;
        for (const SkinCut::Part& p : piece)
            for (std::size_t k = 0; k < 3; ++k) all.emplace_back(p.corner[k], p.corner[(k + 1) % 3]);
        std::sort(all.begin(), all.end());
        std::vector<Edge> border;
        for (const auto& [a, b] : all)
            if (!std::binary_search(all.begin(), all.end(), Edge(b, a))) border.emplace_back(a, b);
        return border;
    }

    const SkinTopology& skin_;
    std::span<const SkinCut::Point> points_;
    std::vector<SkinCut::Part>& parts_;
};

}  // namespace

void redivide(const SkinTopology& skin, std::span<const SkinCut::Point> points, std::vector<SkinCut::Part>& parts)
{
    Redivider(skin, points, parts).run();
}

void redivide(const SkinTopology& skin, std::span<const std::uint8_t> isMoved, SkinCut& cut)
{
    const std::size_t given = skin.pointOf.size();
    std::vector<std::uint32_t> moved;
    for (const SkinCut::Part& part : cut.parts)
        if (std::ranges::any_of(part.corner, [&](std::uint32_t c) { return c >= given && isMoved[c - given]; }))
            moved.push_back(part.triangle);
    sortUnique(moved);
    const auto rest = std::ranges::stable_partition(
        cut.parts, [&](const SkinCut::Part& part) { return !std::ranges::binary_search(moved, part.triangle); });
    std::vector<SkinCut::Part> parts(rest.begin(), rest.end());
    cut.parts.erase(rest.begin(), rest.end());
    redivide(skin, cut.points, parts);
    cut.parts.insert(cut.parts.end(), parts.begin(), parts.end());
    std::ranges::stable_sort(cut.parts, {}, &SkinCut::Part::triangle);
}

}  // namespace vdbfrac::skin
