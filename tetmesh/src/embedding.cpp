#include <vdbfrac/tetmesh/embedding.h>

#include <vdbfrac/base/parallel.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <set>
#include <utility>

namespace vdbfrac::tetmesh {

namespace {

/// Names the crossing of the voxel edge from an inside to an outside node.
std::uint64_t crossingKey(Coord inside, Coord outside, Coord lower)
{
    const Coord c = inside - lower, d = outside - inside;
    const auto bits = [](int v, int shift) { return std::uint64_t(v) << shift; };
    return bits(c.z, 43) | bits(c.y, 24) | bits(c.x, 5) | std::uint64_t((d.z + 1) * 9 + (d.y + 1) * 3 + d.x + 1);
}

struct Corner {
    std::uint64_t key;
    std::uint64_t node;  // key of the outside voxel when the crossing lies on it, else 0
    EmbeddedPoint point;
    bool torn;
};
struct Polygon {
    std::uint32_t firstCorner;
    int size;
};

struct Soup {
    std::vector<Corner> corners;
    std::vector<Polygon> polygons;
};

void addPiece(Soup& soup, const CutMesh& mesh, const Cell& cell, const Piece& piece)
{
    const CellElement& element = mesh.elements()[cell.firstElement + piece.element];
    const CellStencil& stencil = mesh.stencil(element.shape);
    const SubTet& sub = stencil.subTets[piece.subTet];
    const Coord base = mesh.lattice().coarsening * cell.coord, lower = mesh.phi().lower() - Coord{1, 1, 1};
    soup.polygons.push_back({std::uint32_t(soup.corners.size()), piece.cut.polygonSize});
    for (std::size_t k = 0; k < std::size_t(piece.cut.polygonSize); ++k) {
        const Coord in = stencil.vertices[sub.vertex[piece.cut.edge[k][0]]];
        const Coord out = stencil.vertices[sub.vertex[piece.cut.edge[k][1]]];
        const double t = piece.cut.t[k];
        const Vec3 local = in.toVec() + t * (out - in).toVec();
        soup.corners.push_back({crossingKey(base + in, base + out, lower),
                                t == 1 ? crossingKey(base + out, base + out, lower) : 0,
                                embed(mesh, element, sub.parent, local), mesh.wasMaterial(base + out)});
    }
}

/// Index of each corner's point after sharing equal keys and joining neighbours that sit on the same voxel node.
struct Welded {
    std::vector<std::uint32_t> pointOfCorner;
    std::vector<std::uint32_t> cornerOfPoint;
};

/// `apart`: voxel nodes (by key) where neighbours are not joined.
Welded weld(const Soup& soup, const std::set<std::uint64_t>& apart)
{
    const std::size_t n = soup.corners.size();
    std::vector<std::uint32_t> order(n);
    for (std::size_t i = 0; i < n; ++i) order[i] = std::uint32_t(i);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        const auto ka = soup.corners[a].key, kb = soup.corners[b].key;
        return ka != kb ? ka < kb : a < b;
    });
    std::vector<std::uint32_t> root(n);  // the first corner with the same key, then joined
    for (std::size_t i = 0; i < n; ++i)
        root[order[i]] = i > 0 && soup.corners[order[i]].key == soup.corners[order[i - 1]].key ? root[order[i - 1]] : order[i];
    const auto find = [&](std::uint32_t c) {
        while (root[c] != c) c = root[c] = root[root[c]];
        return c;
    };
    for (const Polygon& p : soup.polygons)
        for (int k = 0; k < p.size; ++k) {
            const std::uint32_t a = p.firstCorner + std::uint32_t(k), b = p.firstCorner + std::uint32_t((k + 1) % p.size);
            const std::uint64_t node = soup.corners[a].node;
            if (node == 0 || node != soup.corners[b].node || apart.count(node)) continue;
            const std::uint32_t ra = find(a), rb = find(b);
            root[std::max(ra, rb)] = std::min(ra, rb);
        }
    Welded welded;
    welded.pointOfCorner.resize(n);
    for (std::size_t c = 0; c < n; ++c) {
        const std::uint32_t r = find(std::uint32_t(c));
        if (r == c) {
            welded.pointOfCorner[c] = std::uint32_t(welded.cornerOfPoint.size());
            welded.cornerOfPoint.push_back(r);
        } else
            welded.pointOfCorner[c] = welded.pointOfCorner[r];
    }
    return welded;
}

/// Calls visit(corners a, b, c) for each triangle of the polygons whose points are distinct.
template <class Visit>
void forTriangles(const Soup& soup, const Welded& welded, const Visit& visit)
{
    for (const Polygon& p : soup.polygons)
        for (int k = 2; k < p.size; ++k) {
            const std::uint32_t a = p.firstCorner, b = a + std::uint32_t(k) - 1, c = a + std::uint32_t(k);
            const auto &point = welded.pointOfCorner;
            if (point[a] != point[b] && point[b] != point[c] && point[c] != point[a]) visit(a, b, c);
        }
}

/// Voxel nodes at the ends of edges with more than two triangles. Where a crack of no width ends, joining would pinch its
/// two faces together along such an edge.
std::set<std::uint64_t> pinchedNodes(const Soup& soup, const Welded& welded)
{
    std::vector<std::array<std::uint32_t, 3>> edges;  // least point, other point, a corner at either
    std::vector<std::array<std::uint32_t, 2>> corners;
    forTriangles(soup, welded, [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        for (const auto& [from, to] : {std::pair{a, b}, std::pair{b, c}, std::pair{c, a}}) {
            const std::uint32_t p = welded.pointOfCorner[from], q = welded.pointOfCorner[to];
            edges.push_back({std::min(p, q), std::max(p, q), std::uint32_t(corners.size())});
            corners.push_back({from, to});
        }
    });
    std::sort(edges.begin(), edges.end());
    std::set<std::uint64_t> nodes;
    for (std::size_t i = 2; i < edges.size(); ++i)
        if (edges[i][0] == edges[i - 2][0] && edges[i][1] == edges[i - 2][1])
            for (std::uint32_t corner : corners[edges[i][2]]) nodes.insert(soup.corners[corner].node);
    nodes.erase(0);
    return nodes;
}

/// Joins wherever that leaves a surface with two triangles an edge.
Welded weldManifold(const Soup& soup)
{
    std::set<std::uint64_t> apart;
    for (;;) {
        Welded welded = weld(soup, apart);
        const std::size_t before = apart.size();
        apart.merge(pinchedNodes(soup, welded));
        if (apart.size() == before) return welded;
    }
}

}  // namespace

EmbeddedPoint embed(const CutMesh& mesh, const CellElement& element, int tet, const Vec3& local)
{
    const CellTets& tets = cellTets(element.shape);
    const auto& corner = tets.corner[std::size_t(tet)];
    const auto& gradient = tets.gradient[std::size_t(tet)];
    const int c0 = corner[0];
    const Vec3 d = local / mesh.lattice().coarsening - Vec3(c0 & 1, c0 >> 1 & 1, c0 >> 2 & 1);
    EmbeddedPoint p;
    for (std::size_t a = 0; a < 4; ++a) {
        p.node[a] = element.node[std::size_t(corner[a])];
        p.weight[a] = (a == 0 ? 1 : 0) + gradient[a][0] * d.x() + gradient[a][1] * d.y() + gradient[a][2] * d.z();
    }
    return p;
}

EmbeddedSurface extractSurface(const CutMesh& mesh)
{
    Soup soup;
    for (const Cell& cell : mesh.cells())
        for (const Piece& piece : cell.pieces)
            if (piece.cut.polygonSize > 0) addPiece(soup, mesh, cell, piece);
    const Welded welded = weldManifold(soup);

    EmbeddedSurface surface;
    for (std::uint32_t c : welded.cornerOfPoint) surface.points.push_back(soup.corners[c].point);
    const std::vector<Vec3> rest = restPositions(mesh);
    forTriangles(soup, welded, [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        const std::array<std::uint32_t, 3> v{welded.pointOfCorner[a], welded.pointOfCorner[b], welded.pointOfCorner[c]};
        surface.triangles.push_back(v);
        surface.torn.push_back(soup.corners[a].torn + soup.corners[b].torn + soup.corners[c].torn >= 2);
        const Vec3 o = surface.points[v[0]].at(rest);
        surface.cutArea += 0.5 * (surface.points[v[1]].at(rest) - o).cross(surface.points[v[2]].at(rest) - o).norm();
    });
    return surface;
}

Surface deform(const EmbeddedSurface& embedded, std::span<const Vec3> x, std::span<const std::uint32_t> fragmentOfNode)
{
    Surface surface;
    surface.points.resize(embedded.points.size());
    parallelChunks(embedded.points.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) surface.points[i] = embedded.points[i].at(x);
    });
    surface.triangles = embedded.triangles;
    surface.torn = embedded.torn;
    for (const auto& t : embedded.triangles) surface.fragment.push_back(fragmentOfNode[embedded.points[t[0]].node[0]]);
    return surface;
}

std::vector<Vec3> restPositions(const CutMesh& mesh)
{
    std::vector<Vec3> X(mesh.nodeCount());
    for (std::size_t i = 0; i < X.size(); ++i) X[i] = mesh.restPosition(i);
    return X;
}

}  // namespace vdbfrac::tetmesh
