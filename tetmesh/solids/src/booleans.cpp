#include "booleans.h"

#include "cgal_mesh.h"

#include <vdbfrac/base/disjoint_sets.h>
#include <vdbfrac/tetmesh/surface_input.h>

#include <Eigen/Geometry>

#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/box_intersection_d.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

namespace vdbfrac::solids {

namespace {

namespace PMP = CGAL::Polygon_mesh_processing;

/// None where the triangles are no closed surface round a volume. Without origins all are none.
std::optional<Mesh> meshOf(const Triangles& surface, std::span<const std::uint32_t> origins = {})
{
    Mesh mesh;
    Origins origin = originsOf(mesh);
    for (const Vec3& p : surface.points) mesh.add_vertex(Point(p.x(), p.y(), p.z()));
    for (std::size_t f = 0; f < surface.triangles.size(); ++f) {
        const auto& t = surface.triangles[f];
        const Face face = mesh.add_face(Vertex(t[0]), Vertex(t[1]), Vertex(t[2]));
        if (face == Mesh::null_face()) return std::nullopt;
        if (!origins.empty()) origin[face] = origins[f];
    }
    if (!CGAL::is_closed(mesh)) return std::nullopt;
    return mesh;
}

/// Parts of a face have its origin.
class KeepsOrigin : public PMP::Corefinement::Default_visitor<Mesh> {
public:
    void before_subface_creations(Face whole, Mesh& mesh) { origin_ = originsOf(mesh)[whole]; }
    void after_subface_created(Face part, Mesh& mesh) { originsOf(mesh)[part] = origin_; }
    void after_face_copy(Face from, const Mesh& source, Face to, Mesh& target)
    {
        originsOf(target)[to] = source.property_map<Face, std::uint32_t>(kOrigin).first[from];
    }

private:
    std::uint32_t origin_ = Parts::kNone;
};

bool combine(Mesh& mesh, std::optional<Mesh> second, bool isAdded, double edge)
{
    if (!second) return false;
    const auto how = CGAL::parameters::throw_on_self_intersection(true).visitor(KeepsOrigin());
    try {
        const bool isManifold = isAdded ? PMP::corefine_and_compute_union(mesh, *second, mesh, how)
                                        : PMP::corefine_and_compute_difference(mesh, *second, mesh, how);
        if (isManifold) mesh = ordered(mesh, edge);
        return isManifold;
    } catch (const PMP::Corefinement::Self_intersection_exception&) {
        return false;
    }
}

Parts partsOf(Mesh& mesh)
{
    mesh.collect_garbage();
    const Origins origin = originsOf(mesh);
    Parts parts;
    for (const Vertex v : mesh.vertices()) {
        const Point& p = mesh.point(v);
        parts.surface.points.emplace_back(p.x(), p.y(), p.z());
    }
    for (const Face f : mesh.faces()) {
        std::array<std::uint32_t, 3> t{};
        std::size_t k = 0;
        for (const Vertex v : mesh.vertices_around_face(mesh.halfedge(f))) t[k++] = std::uint32_t(v);
        parts.surface.triangles.push_back(t);
        parts.origin.push_back(origin[f]);
    }
    return parts;
}

/// Without the triangles that `isGone` marks, and without points that no triangle uses then; `pointFor`: what a point
/// has become.
Parts without(const Parts& parts, const std::vector<std::uint8_t>& isGone, std::span<const std::uint32_t> pointFor)
{
    Parts left;
    std::vector<std::uint32_t> number(pointFor.size(), Parts::kNone);
    for (std::size_t f = 0; f < isGone.size(); ++f) {
        if (isGone[f]) continue;
        std::array<std::uint32_t, 3> t = parts.surface.triangles[f];
        for (std::uint32_t& corner : t) number[corner = pointFor[corner]] = 0;
        left.surface.triangles.push_back(t);
        left.origin.push_back(parts.origin[f]);
    }
    for (std::size_t p = 0; p < number.size(); ++p) {
        if (number[p] == Parts::kNone) continue;
        number[p] = std::uint32_t(left.surface.points.size());
        left.surface.points.push_back(parts.surface.points[p]);
    }
    for (auto& t : left.surface.triangles)
        for (std::uint32_t& corner : t) corner = number[corner];
    return left;
}

/// Where solids are flush, corefinement leaves folds: two triangles in one place that look opposite ways, with nothing
/// between them. Takes both away and joins what lies beside them.
Parts unfolded(const Parts& parts)
{
    const std::vector<std::size_t> place = tetmesh::equalPoints(parts.surface.points);
    std::vector<std::uint32_t> pointFor(place.size());
    std::iota(pointFor.begin(), pointFor.end(), 0u);
    std::vector<std::uint8_t> isGone(parts.surface.triangles.size(), 0);
    using Places = std::array<std::size_t, 3>;  // of the corners, as they go round, the least first
    std::map<Places, std::vector<std::size_t>> looking;
    for (std::size_t f = 0; f < isGone.size(); ++f) {
        std::array<std::uint32_t, 3> t = parts.surface.triangles[f];
        std::rotate(t.begin(), std::ranges::min_element(t, {}, [&](std::uint32_t p) { return place[p]; }), t.end());
        const auto others = looking.find(Places{place[t[0]], place[t[2]], place[t[1]]});
        if (others == looking.end() || others->second.empty()) {
            looking[Places{place[t[0]], place[t[1]], place[t[2]]}].push_back(f);
            continue;
        }
        const std::size_t other = others->second.back();
        others->second.pop_back();
        isGone[f] = isGone[other] = 1;
        for (const std::uint32_t p : t)
            for (const std::uint32_t q : parts.surface.triangles[other])
                if (place[p] == place[q]) {
                    const std::uint32_t a = pointFor[p], b = pointFor[q];
                    std::replace(pointFor.begin(), pointFor.end(), std::max(a, b), std::min(a, b));
                }
    }
    return without(parts, isGone, pointFor);
}

/// Triangles that hang together by points, each set with points of its own.
std::vector<Parts> shellsOf(const Parts& whole)
{
    DisjointSets sets(whole.surface.points.size());
    for (const auto& t : whole.surface.triangles) sets.join(t[0], t[1]), sets.join(t[0], t[2]);
    const std::vector<std::uint32_t> setOf = std::move(sets).names();
    std::vector<Parts> shells;
    std::vector<std::uint32_t> shell(setOf.size(), Parts::kNone), number(shell);
    for (std::size_t f = 0; f < whole.surface.triangles.size(); ++f) {
        std::array<std::uint32_t, 3> t = whole.surface.triangles[f];
        std::uint32_t& own = shell[setOf[t[0]]];
        if (own == Parts::kNone) own = std::uint32_t(shells.size()), shells.emplace_back();
        Parts& parts = shells[own];
        for (std::uint32_t& corner : t) {
            std::uint32_t& n = number[corner];
            if (n == Parts::kNone)
                n = std::uint32_t(parts.surface.points.size()),
                parts.surface.points.push_back(whole.surface.points[corner]);
            corner = n;
        }
        parts.surface.triangles.push_back(t);
        parts.origin.push_back(whole.origin[f]);
    }
    return shells;
}

void append(const Parts& parts, Parts& all)
{
    const auto first = std::uint32_t(all.surface.points.size());
    all.surface.points.insert(all.surface.points.end(), parts.surface.points.begin(), parts.surface.points.end());
    for (const auto& t : parts.surface.triangles)
        all.surface.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    all.origin.insert(all.origin.end(), parts.origin.begin(), parts.origin.end());
}

/// None where the parts are no closed surface, or one that is inside out.
std::optional<Mesh> outwardMesh(const Parts& parts)
{
    std::optional<Mesh> mesh = meshOf(parts.surface, parts.origin);
    if (mesh && !PMP::is_outward_oriented(*mesh)) mesh.reset();
    return mesh;
}

Eigen::AlignedBox3d boxOf(const Parts& parts)
{
    Eigen::AlignedBox3d box;
    for (const Vec3& p : parts.surface.points) box.extend(p);
    return box;
}

/// A triangle of a shell, as CGAL looks for boxes that meet.
struct ShellTriangle {
    std::uint32_t shell;
    Kernel::Triangle_3 triangle;
};
using TriangleBox = CGAL::Box_intersection_d::Box_with_info_d<double, 3, const ShellTriangle*>;

/// Joins the sets of shells whose triangles meet.
void joinMeeting(std::span<const Parts> shells, std::span<const std::uint32_t> among, DisjointSets& sets)
{
    std::vector<ShellTriangle> triangles;
    for (const std::uint32_t i : among) {
        const auto point = [&, i](std::uint32_t p) {
            const Vec3& X = shells[i].surface.points[p];
            return Point(X.x(), X.y(), X.z());
        };
        for (const auto& t : shells[i].surface.triangles)
            triangles.push_back({i, {point(t[0]), point(t[1]), point(t[2])}});
    }
    std::vector<TriangleBox> boxes;
    for (const ShellTriangle& t : triangles) boxes.emplace_back(t.triangle.bbox(), &t);
    CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const TriangleBox& a, const TriangleBox& b) {
        const std::uint32_t i = a.info()->shell, j = b.info()->shell;
        if (sets.find(i) != sets.find(j) && CGAL::do_intersect(a.info()->triangle, b.info()->triangle)) sets.join(i, j);
    });
}

/// Closed shells in sets of those that reach into one another or lie in one another; others alone. By rising shell.
std::vector<std::vector<std::uint32_t>> overlapping(std::span<const Parts> shells)
{
    std::vector<Eigen::AlignedBox3d> boxes;
    for (const Parts& s : shells) boxes.push_back(boxOf(s));
    std::vector<std::array<std::uint32_t, 2>> near;
    std::map<std::uint32_t, std::optional<Mesh>> meshes;
    for (std::uint32_t i = 0; i < shells.size(); ++i)
        for (std::uint32_t j = 0; j < i; ++j)
            if (boxes[i].intersects(boxes[j])) near.push_back({i, j}), meshes[i], meshes[j];
    std::vector<std::uint32_t> closed;
    for (auto& [i, mesh] : meshes)
        if ((mesh = outwardMesh(shells[i]))) closed.push_back(i);
    DisjointSets sets(shells.size());
    joinMeeting(shells, closed, sets);
    std::map<std::uint32_t, std::unique_ptr<CGAL::Side_of_triangle_mesh<Mesh, Kernel>>> sides;
    const auto isInside = [&](std::uint32_t inner, std::uint32_t outer) {
        if (!boxes[outer].contains(boxes[inner])) return false;
        auto& side = sides[outer];
        if (!side) side = std::make_unique<CGAL::Side_of_triangle_mesh<Mesh, Kernel>>(*meshes[outer]);
        return (*side)(meshes[inner]->point(Vertex(0))) == CGAL::ON_BOUNDED_SIDE;
    };
    for (const auto& [i, j] : near)
        if (meshes[i] && meshes[j] && sets.find(i) != sets.find(j) && (isInside(i, j) || isInside(j, i)))
            sets.join(i, j);
    std::map<std::uint32_t, std::vector<std::uint32_t>> members;
    for (std::uint32_t i = 0; i < shells.size(); ++i) members[sets.find(i)].push_back(i);
    std::vector<std::vector<std::uint32_t>> clusters;
    for (auto& [first, others] : members) clusters.push_back(std::move(others));
    return clusters;
}

}  // namespace

std::optional<Parts> carved(const Parts& whole, std::span<const Triangles> add, std::span<const Triangles> cut,
                            double edge)
{
    std::optional<Mesh> mesh = outwardMesh(whole);
    if (!mesh) return std::nullopt;
    for (const Triangles& other : add)
        if (!combine(*mesh, meshOf(other), true, edge)) return std::nullopt;
    for (const Triangles& other : cut)
        if (!combine(*mesh, meshOf(other), false, edge)) return std::nullopt;
    tidy(*mesh, edge);
    return unfolded(partsOf(*mesh));
}

United united(const Parts& whole, double edge)
{
    const std::vector<Parts> shells = shellsOf(whole);
    const std::vector<std::vector<std::uint32_t>> clusters = overlapping(shells);
    United result;
    Parts all;
    for (const std::vector<std::uint32_t>& members : clusters) {
        if (members.size() == 1) {
            append(shells[members[0]], all);
            continue;
        }
        result.shells += members.size();
        std::optional<Mesh> mesh = outwardMesh(shells[members[0]]);
        for (std::size_t k = 1; k < members.size() && mesh; ++k)
            if (!combine(*mesh, outwardMesh(shells[members[k]]), true, edge)) mesh.reset();
        if (!mesh) return {result.shells, std::nullopt};
        tidy(*mesh, edge);
        append(unfolded(partsOf(*mesh)), all);
    }
    if (result.shells > 0) result.parts = std::move(all);
    return result;
}

}  // namespace vdbfrac::solids
