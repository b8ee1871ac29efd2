#include "weld.h"

#include <vdbfrac/base/disjoint_sets.h>
#include <vdbfrac/base/key_table.h>
#include <vdbfrac/base/parallel.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <numeric>
#include <set>

namespace vdbfrac::tetmesh {

namespace {

/// The first corner with the same key, of each corner.
std::vector<std::uint32_t> firstOfKey(const std::vector<std::uint64_t>& key)
{
    KeyTable corners(key);
    std::vector<std::uint32_t> first;
    first.reserve(key.size());
    for (std::uint32_t c = 0; c < key.size(); ++c) first.push_back(corners.add(c));
    return first;
}

/// `apart`: voxel nodes (by key) where neighbours are not joined.
Welded weld(const CutPolygons& soup, DisjointSets points, const std::set<std::uint64_t>& apart)
{
    for (const CutPolygons::Polygon& p : soup.polygons)
        for (std::uint32_t k = 0; k < p.size; ++k) {
            const std::uint32_t a = p.firstCorner + k, b = p.firstCorner + (k + 1) % p.size;
            const std::uint64_t node = soup.node[a];
            if (node == 0 || node != soup.node[b] || apart.count(node)) continue;
            points.join(a, b);
        }
    Welded welded;
    welded.pointOfCorner.resize(points.size());
    for (std::size_t c = 0; c < points.size(); ++c) {
        const std::uint32_t r = points.find(std::uint32_t(c));
        if (r == c) {
            welded.pointOfCorner[c] = std::uint32_t(welded.cornerOfPoint.size());
            welded.cornerOfPoint.push_back(r);
        } else
            welded.pointOfCorner[c] = welded.pointOfCorner[r];
    }
    return welded;
}

/// Of each point, the points of higher number it has an edge to, once for each triangle.
struct Neighbours {
    std::vector<std::uint32_t> first;  // of each point, into `other`; one more entry at the end
    std::vector<std::uint32_t> other;
};

Neighbours neighbours(const CutPolygons& soup, const Welded& welded)
{
    Neighbours n;
    n.first.assign(welded.cornerOfPoint.size() + 1, 0);
    const auto forEdges = [&](const auto& visit) {
        forTriangles(soup, welded, [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
            const auto& point = welded.pointOfCorner;
            visit(std::minmax(point[a], point[b]));
            visit(std::minmax(point[b], point[c]));
            visit(std::minmax(point[c], point[a]));
        });
    };
    forEdges([&](auto edge) { ++n.first[edge.first]; });
    std::partial_sum(n.first.begin(), n.first.end(), n.first.begin());
    n.other.resize(n.first.back());
    forEdges([&](auto edge) { n.other[--n.first[edge.first]] = edge.second; });
    return n;
}

/// Voxel nodes at the ends of edges with more than two triangles. Where a crack of no width ends, joining would pinch
/// its two faces together along such an edge.
std::set<std::uint64_t> pinchedNodes(const CutPolygons& soup, const Welded& welded)
{
    Neighbours n = neighbours(soup, welded);
    std::set<std::uint64_t> nodes;
    for (std::size_t p = 0; p + 1 < n.first.size(); ++p) {
        const auto begin = n.other.begin() + n.first[p], end = n.other.begin() + n.first[p + 1];
        std::sort(begin, end);
        for (auto q = begin; end - q > 2; ++q)
            if (q[0] == q[2])  // all corners of a point lie on the same voxel node, or none does
                nodes.insert({soup.node[welded.cornerOfPoint[p]], soup.node[welded.cornerOfPoint[*q]]});
    }
    nodes.erase(0);
    return nodes;
}

}  // namespace

void CutPolygons::add(const CutPolygons& other)
{
    const std::uint32_t corners = std::uint32_t(key.size());
    for (Polygon p : other.polygons) {
        p.firstCorner += corners;
        polygons.push_back(p);
    }
    key.insert(key.end(), other.key.begin(), other.key.end());
    node.insert(node.end(), other.node.begin(), other.node.end());
    torn.insert(torn.end(), other.torn.begin(), other.torn.end());
}

std::uint64_t crossingKey(Coord inside, Coord outside, Coord lower)
{
    const Coord c = inside - lower, d = outside - inside;
    constexpr int kBits = kPlaceBits + 1;  // and some for what lies beside the box
    const auto bits = [](int v, int shift) { return std::uint64_t(v) << (5 + shift); };
    return bits(c.z, 2 * kBits) | bits(c.y, kBits) | bits(c.x, 0) |
           std::uint64_t((d.z + 1) * 9 + (d.y + 1) * 3 + d.x + 1);
}

Welded weldManifold(const CutPolygons& soup)
{
    const DisjointSets first(firstOfKey(soup.key));
    std::set<std::uint64_t> apart;
    for (;;) {
        Welded welded = weld(soup, first, apart);
        const std::size_t before = apart.size();
        apart.merge(pinchedNodes(soup, welded));
        if (apart.size() == before) return welded;
    }
}

namespace {

/// Area [m^2] at rest, added up by rising triangle.
double restArea(const BodyMesh& mesh, const EmbeddedSurface& surface)
{
    std::vector<Vec3> X(surface.points.size());
    parallelChunks(X.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const EmbeddedPoint& p = surface.points[i];
            X[i] = Vec3::Zero();
            for (std::size_t a = 0; a < 4; ++a) X[i] += p.weight[a] * mesh.restPosition(p.node[a]);
        }
    });
    double area = 0;
    for (const auto& t : surface.triangles) area += 0.5 * (X[t[1]] - X[t[0]]).cross(X[t[2]] - X[t[0]]).norm();
    return area;
}

}  // namespace

EmbeddedSurface surfaceOf(const BodyMesh& mesh, const CutPolygons& soup,
                          const std::function<EmbeddedPoint(const CutPolygons::Polygon&, std::uint32_t corner)>& place)
{
    const Welded welded = weldManifold(soup);
    std::vector<std::uint32_t> polygonOfCorner(soup.key.size());
    for (std::size_t p = 0; p < soup.polygons.size(); ++p)
        std::fill_n(polygonOfCorner.begin() + soup.polygons[p].firstCorner, soup.polygons[p].size, std::uint32_t(p));
    EmbeddedSurface surface;
    surface.points.resize(welded.cornerOfPoint.size());
    surface.key.resize(surface.points.size());
    parallelChunks(surface.points.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const std::uint32_t corner = welded.cornerOfPoint[i];
            surface.points[i] = place(soup.polygons[polygonOfCorner[corner]], corner);
            surface.key[i] = soup.key[corner];
        }
    });
    surface.triangles.reserve(2 * surface.points.size());
    surface.torn.reserve(2 * surface.points.size());
    forTriangles(soup, welded, [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        surface.triangles.push_back({welded.pointOfCorner[a], welded.pointOfCorner[b], welded.pointOfCorner[c]});
        surface.torn.push_back(soup.torn[a] + soup.torn[b] + soup.torn[c] >= 2);
    });
    surface.cutArea = restArea(mesh, surface);
    return surface;
}

}  // namespace vdbfrac::tetmesh
