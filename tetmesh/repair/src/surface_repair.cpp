#include <vdbfrac/repair/surface_repair.h>

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_mesh_to_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_degeneracies.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Polygon_mesh_processing/stitch_borders.h>
#include <CGAL/Polygon_mesh_processing/triangulate_faces.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

namespace vdbfrac::repair {

namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;
using Mesh = CGAL::Surface_mesh<Point>;
using Halfedge = Mesh::Halfedge_index;

/// Peak bytes of a wrap, by the triangles it may have: vertices, cells and tree. Measured: below 2 kB a triangle.
constexpr double kBytesPerWrapTriangle = 2500;
/// Triangles of a wrap on an area of alpha^2. Measured on closed surfaces: 3 to 5; an open one is wrapped on both
/// sides.
constexpr double kWrapTriangles = 10;

/// Cubes of coordinates have to fit into doubles, and coordinates have to be told apart.
void requireSaneSize(const tetmesh::SurfaceReport& surface, const std::string& file)
{
    constexpr double kSmallest = 1e-60, kLargest = 1e60;  // m
    const double reach = std::max(surface.lower.cwiseAbs().maxCoeff(), surface.upper.cwiseAbs().maxCoeff());
    const double extent = (surface.upper - surface.lower).maxCoeff();
    if (!(reach <= kLargest && extent >= kSmallest && extent >= 1e-12 * reach))
        throw InputError({file,
                          "has an extent of " + std::to_string(extent) + " m, and reaches " + std::to_string(reach) +
                              " m from the origin",
                          "sizes between 1e-60 and 1e60 m, and not lost in the digits of its coordinates",
                          "check its units"});
}

/// Not too many corners either: orienting and cutting a face into triangles take the square of their number.
void requireSoundFaces(const tetmesh::PolygonSoup& soup, const std::string& file)
{
    for (std::size_t i = 0; i < soup.polygons.size(); ++i) {
        const std::vector<std::size_t>& corners = soup.polygons[i];
        const std::string face = "face " + std::to_string(i + 1) + " has ";
        if (corners.empty() || corners.size() > kMaxCorners)
            throw InputError({file, face + std::to_string(corners.size()) + " corners",
                              "1 to " + std::to_string(kMaxCorners), "cut it into triangles in a modelling program"});
        if (const std::size_t last = *std::max_element(corners.begin(), corners.end()); last >= soup.points.size())
            throw InputError(
                {file, face + "point " + std::to_string(last), "0 to " + std::to_string(soup.points.size() - 1), ""});
    }
}

void requireAlpha(const RepairOptions& options, const std::string& file)
{
    if (!(options.alpha > 0) || !std::isfinite(options.alpha))
        throw InputError({file, "a wrap with alpha " + shortNumber(options.alpha) + " m", "a length above 0", ""});
}

struct CgalSoup {
    std::vector<Point> points;
    std::vector<std::vector<std::size_t>> polygons;
};

CgalSoup toCgal(const tetmesh::PolygonSoup& soup)
{
    CgalSoup out{{}, soup.polygons};
    out.points.reserve(soup.points.size());
    for (const Vec3& p : soup.points) out.points.emplace_back(p.x(), p.y(), p.z());
    return out;
}

tetmesh::PolygonSoup fromCgal(const Mesh& mesh)
{
    CgalSoup soup;
    PMP::polygon_mesh_to_polygon_soup(mesh, soup.points, soup.polygons);
    tetmesh::PolygonSoup out{{}, std::move(soup.polygons)};
    out.points.reserve(soup.points.size());
    for (const Point& p : soup.points) out.points.emplace_back(p.x(), p.y(), p.z());
    return out;
}

/// Polygons whose first two corners are no longer where they were: turning is all that orienting does to them.
std::size_t turned(const CgalSoup& before, const CgalSoup& after)
{
    std::size_t count = 0;
    for (std::size_t i = 0; i < before.polygons.size(); ++i)
        for (std::size_t c = 0; c < 2; ++c)
            if (before.points[before.polygons[i][c]] != after.points[after.polygons[i][c]]) {
                ++count;
                break;
            }
    return count;
}

Mesh toMesh(CgalSoup soup, const std::string& file, Repaired& report)
{
    const std::size_t points = soup.points.size(), polygons = soup.polygons.size();
    PMP::repair_polygon_soup(soup.points, soup.polygons);
    report.joinedPoints = points - std::min(points, soup.points.size());
    report.removedFaces = polygons - std::min(polygons, soup.polygons.size());
    const CgalSoup before = soup;
    PMP::orient_polygon_soup(soup.points, soup.polygons);
    const std::size_t moved = turned(before, soup);
    // Which of both sides is right is not known yet.
    report.turnedFaces = std::min(moved, soup.polygons.size() - moved);
    Mesh mesh;
    PMP::polygon_soup_to_polygon_mesh(soup.points, soup.polygons, mesh);
    PMP::triangulate_faces(mesh);
    if (!CGAL::is_triangle_mesh(mesh))
        throw InputError(
            {file, "has faces that cannot be cut into triangles", "flat faces that do not cross themselves", ""});
    const std::size_t faces = num_faces(mesh);
    PMP::remove_degenerate_faces(mesh);
    report.removedFaces += faces - std::min<std::size_t>(faces, num_faces(mesh));
    PMP::stitch_borders(mesh);
    return mesh;
}

void tell(const RepairOptions& options, const std::string& what)
{
    if (options.say) options.say(what);
}

double widestExtent(const Mesh& mesh, Halfedge border)
{
    CGAL::Bbox_3 box;
    for (Halfedge h : halfedges_around_face(border, mesh)) box += mesh.point(target(h, mesh)).bbox();
    return std::max({box.x_span(), box.y_span(), box.z_span()});
}

void fillHoles(Mesh& mesh, const RepairOptions& options, Repaired& report)
{
    std::vector<Halfedge> cycles;
    PMP::extract_boundary_cycles(mesh, std::back_inserter(cycles));
    if (!cycles.empty()) tell(options, "filling " + counted(cycles.size(), "hole"));
    for (Halfedge border : cycles) {
        const auto edges = halfedges_around_face(border, mesh);
        if (std::size_t(std::distance(edges.begin(), edges.end())) > kLongestHole) continue;
        const double width = widestExtent(mesh, border);
        std::vector<Mesh::Face_index> added;
        PMP::triangulate_hole(mesh, border, std::back_inserter(added));
        if (added.empty()) continue;
        ++report.filledHoles;
        report.widestHole = std::max(report.widestHole, width);
    }
}

void requireMemory(const tetmesh::SurfaceReport& surface, const RepairOptions& options, const std::string& file)
{
    const double bytes = kBytesPerWrapTriangle * kWrapTriangles * surface.area / (options.alpha * options.alpha);
    if (bytes > double(options.memoryLimit))
        throw LimitError(file + ": a wrap with alpha " + std::to_string(options.alpha) + " m needs about " +
                         shortNumber(bytes / 1e9) + " GB, the memory limit is " +
                         shortNumber(double(options.memoryLimit) / 1e9) + " GB; take a larger alpha");
}

/// Do so many triangles meet at some points that a search among those near a place takes the square of all of them?
bool isCrowded(const Mesh& mesh)
{
    constexpr double kFew = 1e7, kFewPerFace = 100;  // of the sum below; most meshes have 18 a face
    double sum = 0;
    for (const Mesh::Vertex_index v : mesh.vertices()) {
        const double degree = double(mesh.degree(v));
        sum += degree * degree;
    }
    return sum > kFew + kFewPerFace * double(num_faces(mesh));
}

/// Points in one cell become the first of them, and triangles that lose a corner by that go. Moves nothing by more than
/// a cell.
void thinOut(CgalSoup& soup, double cell)
{
    std::map<std::array<double, 3>, std::size_t> first;
    std::vector<std::size_t> kept(soup.points.size());
    for (std::size_t i = 0; i < soup.points.size(); ++i) {
        const Point& p = soup.points[i];
        kept[i] = first.try_emplace({std::floor(p.x() / cell), std::floor(p.y() / cell), std::floor(p.z() / cell)}, i)
                      .first->second;
    }
    for (auto& polygon : soup.polygons)
        for (std::size_t& corner : polygon) corner = kept[corner];
    std::erase_if(soup.polygons, [](const auto& p) { return p[0] == p[1] || p[1] == p[2] || p[2] == p[0]; });
}

Mesh wrap(const Mesh& mesh, const RepairOptions& options)
{
    constexpr double kCellOfAlpha = 1. / 32;  // far below what a wrap resolves
    CgalSoup soup;
    PMP::polygon_mesh_to_polygon_soup(mesh, soup.points, soup.polygons);
    if (isCrowded(mesh)) thinOut(soup, kCellOfAlpha * options.alpha);
    Mesh wrapped;
    CGAL::alpha_wrap_3(soup.points, soup.polygons, options.alpha, options.offset, wrapped);
    return wrapped;
}

struct TooManyLookUps {};

/// The points of a mesh, which counts how often they are looked at and ends that when it is too often.
struct CountedPoints {
    using key_type = Mesh::Vertex_index;
    using value_type = Point;
    using reference = const Point&;
    using category = boost::readable_property_map_tag;

    const Mesh* mesh;
    std::uint64_t *count, most;

    friend const Point& get(const CountedPoints& points, key_type v)
    {
        if (++*points.count > points.most) throw TooManyLookUps();
        return points.mesh->point(v);
    }
};

void lookForIntersections(const Mesh& mesh, Repaired& report)
try {
    const CountedPoints points{&mesh, &report.lookUps, kMaxLookUps + kMaxLookUpsPerFace * num_faces(mesh)};
    report.intersectsItself = PMP::does_self_intersect(mesh, CGAL::parameters::vertex_point_map(points));
} catch (const TooManyLookUps&) {
    report.searchGivenUp = true;
}

bool needsWrap(const Mesh& mesh, const RepairOptions& options, Repaired& report)
{
    if (options.wrapAlways) return true;
    tell(options, "looking where " + std::to_string(num_faces(mesh)) + " triangles intersect");
    lookForIntersections(mesh, report);
    return options.wrapWhenNeeded && (report.intersectsItself || !is_closed(mesh));
}

}  // namespace

Repaired repairSurface(const tetmesh::PolygonSoup& soup, const tetmesh::SurfaceReport& before,
                       const RepairOptions& options, const std::string& file)
try {
    Repaired report;
    report.before = before;
    requireSaneSize(before, file);
    requireSoundFaces(soup, file);
    tell(options, "cleaning " + std::to_string(soup.polygons.size()) + " faces");
    Mesh mesh = toMesh(toCgal(soup), file, report);
    if (num_faces(mesh) == 0) throw InputError({file, "has no faces with area", "a surface", ""});
    if (options.fillHoles) fillHoles(mesh, options, report);
    if (needsWrap(mesh, options, report)) {
        requireAlpha(options, file);
        requireMemory(report.before, options, file);
        tell(options, "wrapping it");
        mesh = wrap(mesh, options);
        report.wrapped = true;
    }
    report.soup = fromCgal(mesh);
    report.after = tetmesh::examine(report.soup);
    if (report.after.volume < 0 && report.after.closed) {
        for (auto& polygon : report.soup.polygons) std::reverse(polygon.begin(), polygon.end());
        report.after.volume = -report.after.volume;
    }
    return report;
} catch (const CGAL::Failure_exception& e) {
    throw InputError({file, std::string("cannot be repaired: ") + e.what(), "", "repair it in a modelling program"});
}

}  // namespace vdbfrac::repair
