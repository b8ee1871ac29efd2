#include "cgal_mesh.h"

#include <Eigen/Geometry>

#include <CGAL/Polygon_mesh_processing/detect_features.h>
#include <CGAL/boost/graph/Euler_operations.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

namespace vdbfrac::solids {

namespace {

namespace PMP = CGAL::Polygon_mesh_processing;

Point roundedPoint(const Point& p, double edge)
{
    const Vec3 r = rounded(Vec3(p.x(), p.y(), p.z()), edge);
    return {r.x(), r.y(), r.z()};
}

}  // namespace

Vec3 rounded(const Vec3& X, double edge)
{
    constexpr double kDigits = 9;  // below the edges that are wanted
    const double perMetre = std::pow(10., kDigits - std::floor(std::log10(edge)));
    return (X.array() * perMetre).round() / perMetre;
}

Mesh ordered(Mesh& mesh, double edge)
{
    mesh.collect_garbage();
    std::vector<std::size_t> order(mesh.number_of_vertices()), rank(order.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto point = [&](std::size_t i) -> const Point& { return mesh.point(Vertex(unsigned(i))); };
    std::vector<Point> place;
    for (std::size_t i = 0; i < order.size(); ++i) place.push_back(roundedPoint(point(i), edge));
    // Of points in one place what is round them tells; their last bits may differ from run to run.
    const auto round = [&](std::size_t i) {
        std::vector<Point> places;
        for (const Vertex v : mesh.vertices_around_target(mesh.halfedge(Vertex(unsigned(i)))))
            places.push_back(place[v]);
        std::sort(places.begin(), places.end());
        return places;
    };
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        if (a == b) return false;
        return place[a] != place[b] ? place[a] < place[b]
                                    : std::pair(round(a), point(a)) < std::pair(round(b), point(b));
    });
    Mesh result;
    for (std::size_t i = 0; i < order.size(); ++i) {
        rank[order[i]] = i;
        result.add_vertex(point(order[i]));
    }
    std::vector<std::pair<std::array<std::size_t, 3>, std::uint32_t>> faces;
    for (const auto f : mesh.faces()) {
        std::array<std::size_t, 3> t{};
        std::size_t k = 0;
        for (const auto v : mesh.vertices_around_face(mesh.halfedge(f))) t[k++] = rank[v];
        std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
        faces.emplace_back(t, originsOf(mesh)[f]);
    }
    std::sort(faces.begin(), faces.end());
    const auto vertex = [](std::size_t i) { return Vertex(unsigned(i)); };
    Origins origin = originsOf(result);
    for (const auto& [t, from] : faces) origin[result.add_face(vertex(t[0]), vertex(t[1]), vertex(t[2]))] = from;
    return result;
}

namespace {

class Tidier {
public:
    Tidier(Mesh& mesh, double edge) : mesh_(mesh), origin_(originsOf(mesh)), edge_(edge), shortest_(kShort * edge) {}

    void run()
    {
        constexpr int kRounds = 3;
        for (const Vertex v : mesh_.vertices()) mesh_.point(v) = roundedPoint(mesh_.point(v), edge_);
        for (int round = 0; round < kRounds; ++round) removeFlatFaces();
        reorder();
        // However flat faces were divided, from here on it is one way.
        constexpr int kMost = 100;
        findSharpEdges();
        for (int round = 0; round < kMost && flipAll(); ++round) {}
        reorder();
        for (int round = 0; round < kRounds; ++round) {
            findSharpEdges();
            for (const Edge e : edges())
                if (!mesh_.is_removed(e)) collapse(mesh_.halfedge(e)) || collapse(mesh_.opposite(mesh_.halfedge(e)));
            flipAll();
        }
        reorder();
    }

private:
    using Edge = Mesh::Edge_index;
    using Halfedge = Mesh::Halfedge_index;
    static constexpr double kShort = 0.35;    // of the edges that are wanted
    static constexpr double kFlat = 0.99999;  // cosine between triangles of one plane

    /// Faces without area, where lines of the solids lay on each other: their edges would count as sharp.
    void removeFlatFaces()
    {
        constexpr double kNothing = 1e-7;  // of the shortest edge
        const double nothing = kNothing * shortest_;
        for (const Edge e : edges()) {
            if (mesh_.is_removed(e)) continue;
            const Halfedge h = mesh_.halfedge(e);
            const bool isNothing = (at(mesh_.source(h)) - at(mesh_.target(h))).norm() < nothing;
            if (isNothing && CGAL::Euler::does_satisfy_link_condition(e, mesh_)) CGAL::Euler::collapse_edge(e, mesh_);
        }
        for (const Edge e : edges()) {
            if (mesh_.is_removed(e)) continue;
            for (const Halfedge h : {mesh_.halfedge(e), mesh_.opposite(mesh_.halfedge(e))}) {
                const Vertex a = mesh_.source(h), b = mesh_.target(h), c = mesh_.target(mesh_.next(h)),
                             d = mesh_.target(mesh_.next(mesh_.opposite(h)));
                const Vec3 along = at(b) - at(a);
                const double share = along.dot(at(c) - at(a)) / along.squaredNorm();
                if (share <= 0 || share >= 1 || area(a, b, c).norm() > nothing * along.norm()) continue;
                if (mesh_.halfedge(c, d) != Mesh::null_halfedge()) continue;
                const std::uint32_t beyond = origin_[mesh_.face(mesh_.opposite(h))];
                CGAL::Euler::flip_edge(h, mesh_);
                origin_[mesh_.face(h)] = origin_[mesh_.face(mesh_.opposite(h))] = beyond;
                break;
            }
        }
    }

    void reorder()
    {
        mesh_ = ordered(mesh_, edge_);
        origin_ = originsOf(mesh_);
    }
    std::vector<Edge> edges() const { return {mesh_.edges().begin(), mesh_.edges().end()}; }
    void findSharpEdges()
    {
        isSharp_ = mesh_.add_property_map<Edge, bool>("e:is_sharp", false).first;
        for (const Edge e : mesh_.edges()) isSharp_[e] = false;
        PMP::detect_sharp_edges(mesh_, kCrease, isSharp_);
        // Each triangle that was given has its own texture coordinates.
        for (const Edge e : mesh_.edges()) {
            const Halfedge h = mesh_.halfedge(e);
            if (origin_[mesh_.face(h)] != origin_[mesh_.face(mesh_.opposite(h))]) isSharp_[e] = true;
        }
    }
    Vec3 at(Vertex v) const
    {
        const Point& p = mesh_.point(v);
        return {p.x(), p.y(), p.z()};
    }
    Vec3 area(Vertex a, Vertex b, Vertex c) const { return (at(b) - at(a)).cross(at(c) - at(a)); }

    /// Puts the source of an edge onto its target, where the triangles round it stay in their planes.
    bool collapse(Halfedge h)
    {
        const Vertex from = mesh_.source(h), to = mesh_.target(h);
        if ((at(from) - at(to)).norm() > shortest_) return false;
        int sharp = 0;
        for (const Halfedge k : mesh_.halfedges_around_target(mesh_.opposite(h))) sharp += isSharp_[mesh_.edge(k)];
        if (sharp != 0 && !(sharp == 2 && isSharp_[mesh_.edge(h)] && isStraight(from, to))) return false;
        for (const Halfedge k : mesh_.halfedges_around_target(mesh_.opposite(h))) {
            const Vertex a = mesh_.target(mesh_.next(k)), b = mesh_.source(k);
            if (a == to || b == to) continue;
            const Vec3 before = area(from, a, b), after = area(to, a, b);
            if (before.dot(after) <= kFlat * before.norm() * after.norm()) return false;
        }
        if (!CGAL::Euler::does_satisfy_link_condition(mesh_.edge(h), mesh_)) return false;
        CGAL::Euler::collapse_edge(mesh_.edge(h), mesh_, isSharp_);
        return true;
    }
    /// Does the sharp line go straight on behind `from`?
    bool isStraight(Vertex from, Vertex to) const
    {
        for (const Halfedge k : mesh_.halfedges_around_target(mesh_.halfedge(from))) {
            const Vertex other = mesh_.source(k);
            if (other == to || !isSharp_[mesh_.edge(k)]) continue;
            const Vec3 u = (at(from) - at(to)).stableNormalized(), v = (at(other) - at(from)).stableNormalized();
            if (u.dot(v) < kFlat) return false;
        }
        return true;
    }

    bool flipAll()
    {
        bool any = false;
        for (const Edge e : edges()) any = flip(e) || any;
        return any;
    }
    bool flip(Edge e)
    {
        if (mesh_.is_removed(e) || isSharp_[e]) return false;
        const Halfedge h = mesh_.halfedge(e), o = mesh_.opposite(h);
        const Vertex a = mesh_.source(h), b = mesh_.target(h), c = mesh_.target(mesh_.next(h)),
                     d = mesh_.target(mesh_.next(o));
        const auto cosine = [&](Vertex tip) {
            return (at(a) - at(tip)).stableNormalized().dot((at(b) - at(tip)).stableNormalized());
        };
        constexpr double kClear = 1e-6;  // on squares both ways are as good: then towards the first point
        const double sum = std::acos(std::clamp(cosine(c), -1., 1.)) + std::acos(std::clamp(cosine(d), -1., 1.));
        const bool isTie = std::abs(sum - std::numbers::pi) <= kClear && std::min(c, d) < std::min(a, b);
        if (!(sum > std::numbers::pi + kClear || isTie) || mesh_.halfedge(c, d) != Mesh::null_halfedge()) return false;
        const Vec3 first = area(a, d, c), second = area(b, c, d), whole = area(a, b, c) + area(b, a, d);
        for (const Vec3& part : {first, second})
            if (part.dot(whole) <= kFlat * part.norm() * whole.norm()) return false;
        CGAL::Euler::flip_edge(h, mesh_);
        return true;
    }

    Mesh& mesh_;
    Origins origin_;
    double edge_, shortest_;  // m
    Mesh::Property_map<Edge, bool> isSharp_;
};

}  // namespace

void tidy(Mesh& mesh, double edge) { Tidier(mesh, edge).run(); }

}  // namespace vdbfrac::solids
