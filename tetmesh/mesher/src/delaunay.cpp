// The one file that compiles Mesh_3.
#include "start_edges.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/mesher/delaunay.h>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Labeled_mesh_domain_3.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_domain_with_polyline_features_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Spatial_sort_traits_adapter_3.h>
#include <CGAL/hilbert_sort.h>
#include <CGAL/make_mesh_3.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <unordered_map>

namespace vdbfrac::mesher {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Domain = CGAL::Mesh_domain_with_polyline_features_3<CGAL::Labeled_mesh_domain_3<Kernel>>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain, CGAL::Default, CGAL::Sequential_tag>::type;
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation, Domain::Corner_index, Domain::Curve_index>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;

// The surface is found on a segment to this share of facetDistance.
constexpr double kBisection = 0.01;
// Start points are this many facetSizes apart: refinement places nearly all points itself.
constexpr double kStartApart = 3;
// Parts wider than this share of a facetSize are found.
constexpr double kSampling = 0.5;

Point toCgal(const Vec3& p) { return {p.x(), p.y(), p.z()}; }
Vec3 fromCgal(const Point& p) { return {p.x(), p.y(), p.z()}; }

/// A size [m] that the user's field may lower.
struct Size {
    using FT = double;
    using Point_3 = Point;
    using Index = Domain::Index;

    double most;
    const std::function<double(const Vec3&)>* field;

    double operator()(const Point& p, int, const Index&) const
    {
        return *field ? std::min(most, (*field)(fromCgal(p))) : most;
    }
};

void require(bool good, const std::string& what, const std::string& allowed)
{
    if (!good) throw InputError({"Delaunay mesh", what, allowed, ""});
}

/// The criteria with every default filled in.
DelaunayCriteria checked(DelaunayCriteria c)
{
    const auto length = [](double v) { return v > 0 && std::isfinite(v); };
    require(length(c.facetSize), "facet size " + shortNumber(c.facetSize) + " m", "> 0");
    for (auto [value, otherwise] :
         {std::pair{&c.facetDistance, 0.1 * c.facetSize}, {&c.cellSize, c.facetSize}, {&c.edgeSize, c.facetSize}}) {
        if (*value == 0) *value = otherwise;
        require(length(*value), "a size of " + shortNumber(*value) + " m", "> 0, or 0 for the default");
    }
    require(c.facetAngle >= 0 && c.facetAngle <= 30, "facet angle " + shortNumber(c.facetAngle), "0 to 30 degrees");
    require(c.radiusEdge >= 1, "radius-edge ratio " + shortNumber(c.radiusEdge),
            ">= 1; above 2 the refinement is sure to end");
    require(c.sliverAngle >= 0 && c.sliverAngle <= 40, "sliver angle " + shortNumber(c.sliverAngle), "0 to 40 degrees");
    return c;
}

Domain makeDomain(const ImplicitSolid& solid, const DelaunayCriteria& criteria)
{
    const Vec3 &a = solid.box.lower, &b = solid.box.upper;
    require(solid.phi != nullptr && a.allFinite() && b.allFinite() && (b - a).minCoeff() > 0,
            "phi or its box is missing", "a box with volume");
    const auto label = [&phi = solid.phi](const Point& p) { return phi(fromCgal(p)) < 0 ? 1 : 0; };
    const double bound = kBisection * criteria.facetDistance / (0.5 * (b - a).norm());
    Domain domain(label, CGAL::Bbox_3(a.x(), a.y(), a.z(), b.x(), b.y(), b.z()), bound);
    std::vector<std::vector<Point>> lines;
    for (const Polyline& line : solid.sharpEdges) {
        require(line.size() >= 2, "a sharp edge of one point", "2 points or more");
        lines.emplace_back();
        for (const Vec3& p : line) lines.back().push_back(toCgal(p));
    }
    domain.add_features(lines.begin(), lines.end());
    return domain;
}

/// Does a ball that protects a sharp edge hold p?
bool isProtected(const Triangulation& t, const Point& p)
{
    if (t.dimension() < 3) return false;
    const auto v = t.nearest_power_vertex(p);
    return v != Triangulation::Vertex_handle() && CGAL::squared_distance(v->point().point(), p) <= v->point().weight();
}

/// Points on every component of the surface. CGAL shoots rays from the middle of the box, which miss what is small or
/// hidden.
void insertStartPoints(Complex& complex, const Domain& domain, const std::vector<SurfaceEdge>& edges)
{
    const auto intersection = domain.construct_intersection_object();
    for (const SurfaceEdge& edge : edges) {
        const auto [p, index, dimension] = intersection(Kernel::Segment_3(toCgal(edge.inside), toCgal(edge.outside)));
        if (dimension != 2 || isProtected(complex.triangulation(), p)) continue;
        const auto v = complex.triangulation().insert(Triangulation::Weighted_point(p));
        if (v == Triangulation::Vertex_handle()) continue;  // hidden by others
        complex.set_dimension(v, 2);
        complex.set_index(v, Domain::Index(index));
    }
}

/// Throws LimitError when CGAL stopped at the most points.
void checkPoints(CGAL::Mesh_error_code error, const DelaunayCriteria& c)
{
    if (error == CGAL::CGAL_MESH_3_MAXIMAL_NUMBER_OF_VERTICES_REACHED)
        throw LimitError("Delaunay mesh: more than " + std::to_string(c.maxPoints) + " points; make the tets larger");
}

Complex mesh(const ImplicitSolid& solid, const DelaunayCriteria& c)
{
    namespace p = CGAL::parameters;
    const Domain domain = makeDomain(solid, c);
    const auto size = [&](double most) { return Size{most, &c.sizing}; };
    const Criteria criteria(Criteria::Edge_criteria(size(c.edgeSize)),
                            Criteria::Facet_criteria(c.facetAngle, size(c.facetSize), c.facetDistance),
                            Criteria::Cell_criteria(c.radiusEdge, size(c.cellSize)));
    const std::vector<SurfaceEdge> start = startEdges(solid, kSampling * c.facetSize, kStartApart * c.facetSize);
    Complex complex;
    CGAL::Mesh_error_code error{};
    if (!solid.sharpEdges.empty()) {
        CGAL::Mesh_3::internal::init_c3t3_with_features(complex, domain, criteria, false, c.maxPoints, &error);
        checkPoints(error, c);
    }
    insertStartPoints(complex, domain, start);
    p::internal::Mesh_3_options options;
    options.maximal_number_of_vertices = c.maxPoints;
    options.pointer_to_error_code = &error;
    // Without a limit of their own these stages may take as long as the refinement took by the clock: no two runs would
    // agree.
    constexpr double kNoLimit = 0;
    CGAL::refine_mesh_3(
        complex, domain, criteria,
        c.exude ? p::exude(p::sliver_bound = c.sliverAngle, p::time_limit = kNoLimit) : p::no_exude(),
        c.perturb ? p::perturb(p::sliver_bound = c.sliverAngle, p::time_limit = kNoLimit) : p::no_perturb(),
        p::no_odt(), p::no_lloyd(), p::no_reset_c3t3(), options, p::manifold());
    checkPoints(error, c);
    return complex;
}

/// Vertices of the complex' cells in the order of a Hilbert curve, and the number of each.
using Vertex = Triangulation::Vertex_handle;
std::vector<Vec3> pointsOf(const Complex& complex, std::unordered_map<Vertex, std::uint32_t>& number)
{
    std::vector<Point> points;
    std::vector<Vertex> vertices;
    for (auto cell = complex.cells_in_complex_begin(); cell != complex.cells_in_complex_end(); ++cell)
        for (int a = 0; a < 4; ++a)
            if (number.try_emplace(cell->vertex(a), 0).second) {
                vertices.push_back(cell->vertex(a));
                points.push_back(cell->vertex(a)->point().point());
            }
    std::vector<std::size_t> order(points.size());
    std::iota(order.begin(), order.end(), std::size_t(0));
    const auto place = CGAL::make_property_map(points);
    CGAL::hilbert_sort(order.begin(), order.end(), CGAL::Spatial_sort_traits_adapter_3<Kernel, decltype(place)>(place));
    std::vector<Vec3> sorted;
    for (std::size_t i : order) {
        number[vertices[i]] = std::uint32_t(sorted.size());
        sorted.push_back(fromCgal(points[i]));
    }
    return sorted;
}

tetmesh::TetMesh extract(const Complex& complex)
{
    tetmesh::TetMesh mesh;
    std::unordered_map<Vertex, std::uint32_t> number;
    mesh.points = pointsOf(complex, number);
    for (auto cell = complex.cells_in_complex_begin(); cell != complex.cells_in_complex_end(); ++cell) {
        std::array<std::uint32_t, 4> tet;  // CGAL's cells are positively oriented, as ours
        for (int a = 0; a < 4; ++a) tet[std::size_t(a)] = number.at(cell->vertex(a));
        mesh.tets.push_back(tetmesh::lowestFirst(tet));
    }
    std::sort(mesh.tets.begin(), mesh.tets.end());
    mesh.boundary = tetmesh::boundaryOf(mesh.tets);
    return mesh;
}

}  // namespace

tetmesh::TetMesh delaunayMesh(const ImplicitSolid& solid, const DelaunayCriteria& criteria)
{
    return extract(mesh(solid, checked(criteria)));
}

}  // namespace vdbfrac::mesher
