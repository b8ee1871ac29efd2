#include <vdbfrac/mesher/sharp_edges.h>

#include <CGAL/boost/graph/split_graph_into_polylines.h>

#include <boost/graph/adjacency_list.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace vdbfrac::mesher {

namespace {

using Graph = boost::adjacency_list<boost::setS, boost::vecS, boost::undirectedS, Vec3>;
using Vertex = boost::graph_traits<Graph>::vertex_descriptor;

Vec3 normalOf(const tetmesh::PolygonSoup& soup, const std::vector<std::size_t>& polygon)
{
    Vec3 normal = Vec3::Zero();  // Newell's: right for polygons that are not quite flat
    for (std::size_t c = 0; c < polygon.size(); ++c)
        normal += soup.points[polygon[c]].cross(soup.points[polygon[(c + 1) % polygon.size()]]);
    return normal.stableNormalized();
}

/// The normals at each edge, by its ends' numbers; points with equal coordinates have one number.
struct Edges {
    std::vector<Vec3> points;
    std::map<std::pair<std::size_t, std::size_t>, std::vector<Vec3>> normals;
};

Edges edgesOf(const tetmesh::PolygonSoup& soup)
{
    Edges edges;
    std::map<std::array<double, 3>, std::size_t> number;
    std::vector<std::size_t> of;
    for (const Vec3& p : soup.points) {
        const auto [at, isNew] = number.emplace(std::array{p.x() + 0., p.y() + 0., p.z() + 0.}, edges.points.size());
        if (isNew) edges.points.push_back(p);
        of.push_back(at->second);
    }
    for (const auto& polygon : soup.polygons) {
        const Vec3 normal = normalOf(soup, polygon);
        if (normal.isZero()) continue;  // without area it has no side
        for (std::size_t c = 0; c < polygon.size(); ++c) {
            const std::size_t a = of[polygon[c]], b = of[polygon[(c + 1) % polygon.size()]];
            if (a != b) edges.normals[std::minmax(a, b)].push_back(normal);
        }
    }
    return edges;
}

/// Ends a line at a vertex where it turns sharply; where more or fewer than two edges meet it ends anyway.
struct TurnsSharply {
    double cosine;
    bool operator()(Vertex v, const Graph& graph) const
    {
        const auto [begin, end] = boost::adjacent_vertices(v, graph);
        if (std::distance(begin, end) != 2) return true;
        const Vec3 in = (graph[v] - graph[*begin]).normalized(),
                   out = (graph[*std::next(begin)] - graph[v]).normalized();
        return in.dot(out) < cosine;
    }
};

struct Collector {
    std::vector<Polyline>& lines;
    const Graph& graph;

    void start_new_polyline() { lines.emplace_back(); }
    void add_node(Vertex v) { lines.back().push_back(graph[v]); }
    void end_polyline() {}
};

}  // namespace

std::vector<Polyline> sharpEdges(const tetmesh::PolygonSoup& soup, double degrees)
{
    const double cosine = std::cos(degrees * std::numbers::pi / 180);
    const Edges edges = edgesOf(soup);
    Graph graph;
    std::map<std::size_t, Vertex> vertex;
    const auto vertexOf = [&](std::size_t p) {
        const auto [at, isNew] = vertex.emplace(p, Vertex());
        if (isNew) at->second = boost::add_vertex(edges.points[p], graph);
        return at->second;
    };
    for (const auto& [ends, normals] : edges.normals)
        if (normals.size() > 2 || (normals.size() == 2 && normals[0].dot(normals[1]) < cosine))
            boost::add_edge(vertexOf(ends.first), vertexOf(ends.second), graph);
    std::vector<Polyline> lines;
    Collector collector{lines, graph};
    CGAL::split_graph_into_polylines(graph, collector, TurnsSharply{cosine});
    return lines;
}

}  // namespace vdbfrac::mesher
