#include <vdbfrac/solids/solid_mesh.h>

#include "solid_shapes.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/detect_features.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Surface_mesh.h>

namespace vdbfrac::solids {

namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;
using Mesh = CGAL::Surface_mesh<Point>;

constexpr double kCrease = 40;  // degrees: more than between the pieces of any round surface, less than of edges

Mesh meshOf(const Primitive& solid, double edge, const Bounds& within)
{
    const Triangles surface = trianglesOf(solid, edge, within);
    Mesh mesh;
    for (const Vec3& p : surface.points) mesh.add_vertex(Point(p.x(), p.y(), p.z()));
    using Vertex = Mesh::Vertex_index;
    for (const auto& t : surface.triangles) mesh.add_face(Vertex(t[0]), Vertex(t[1]), Vertex(t[2]));
    return mesh;
}

tetmesh::RenderMesh renderMeshOf(Mesh& mesh)
{
    mesh.collect_garbage();
    tetmesh::RenderMesh result;
    for (const auto v : mesh.vertices()) {
        const Point& p = mesh.point(v);
        result.points.emplace_back(p.x(), p.y(), p.z());
    }
    for (const auto f : mesh.faces()) {
        std::array<tetmesh::RenderMesh::Corner, 3> corners;
        std::size_t k = 0;
        for (const auto v : mesh.vertices_around_face(mesh.halfedge(f))) corners[k++].point = std::uint32_t(v);
        result.addFace(corners, tetmesh::RenderMesh::kNone, tetmesh::RenderMesh::kNone);
    }
    return result;
}

/// Corefinement leaves slivers along its lines, which fold over when their surface moves: even triangles instead.
void even(Mesh& mesh, double edge)
{
    const auto isSharp = mesh.add_property_map<Mesh::Edge_index, bool>("e:is_sharp", false).first;
    PMP::detect_sharp_edges(mesh, kCrease, isSharp);
    PMP::isotropic_remeshing(mesh.faces(), edge, mesh,
                             CGAL::parameters::number_of_iterations(3).edge_is_constrained_map(isSharp));
}

Bounds joined(const Bounds& a, const Bounds& b) { return {a.lower.cwiseMin(b.lower), a.upper.cwiseMax(b.upper)}; }

}  // namespace

std::optional<tetmesh::RenderMesh> solidMesh(const SolidBody& body, double edge)
{
    Bounds within = bounds(body.shape);
    for (const Primitive& p : body.add) within = joined(within, bounds(p));
    Mesh mesh = meshOf(body.shape, edge, within);
    for (const Primitive& p : body.add) {
        Mesh other = meshOf(p, edge, within);
        if (!PMP::corefine_and_compute_union(mesh, other, mesh)) return std::nullopt;
    }
    for (const Primitive& p : body.cut) {
        Mesh other = meshOf(p, edge, within);
        if (!PMP::corefine_and_compute_difference(mesh, other, mesh)) return std::nullopt;
    }
    if (!body.add.empty() || !body.cut.empty()) even(mesh, edge);
    tetmesh::RenderMesh result = renderMeshOf(mesh);
    tetmesh::setNormals(result, kCrease);
    return result;
}

}  // namespace vdbfrac::solids
