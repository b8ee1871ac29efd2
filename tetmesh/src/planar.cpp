#include <vdbfrac/tetmesh/planar.h>

#include <vdbfrac/base/polygon.h>

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <map>
#include <utility>

namespace vdbfrac::tetmesh {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
constexpr std::uint32_t kNew = ~0u;  // a point that the triangulation made, where lines cross

struct PointNumber {
    std::uint32_t value = kNew;
};
using Triangulation = CGAL::Constrained_Delaunay_triangulation_2<
    Kernel,
    CGAL::Triangulation_data_structure_2<CGAL::Triangulation_vertex_base_with_info_2<PointNumber, Kernel>,
                                         CGAL::Constrained_triangulation_face_base_2<Kernel>>,
    CGAL::Exact_predicates_tag>;
using Face = Triangulation::Face_handle;

class Divider {
public:
    explicit Divider(const PlanarPolygon& polygon) : polygon_(polygon)
    {
        for (std::uint32_t i = 0; i < polygon.points.size(); ++i) {
            const auto& p = polygon.points[i];
            const auto vertex = cdt_.insert({p[0], p[1]});
            result_.isSound = result_.isSound && vertex->info().value == kNew;
            if (vertex->info().value == kNew) vertex->info().value = i;
            vertex_.push_back(vertex);
        }
        for (std::size_t i = 0; i < polygon.outline.size(); ++i) {
            const auto [a, b] = polygon.outline[i];
            outline_[std::minmax(a, b)] = polygon.label[i];
            constrain(a, b);
        }
        for (const auto& line : polygon.lines) constrain(line[0], line[1]);
        result_.isSound = result_.isSound && cdt_.number_of_vertices() == polygon.points.size();
    }

    PlanarTriangles run()
    {
        if (cdt_.dimension() < 2) {
            result_.isSound = false;
            return std::move(result_);
        }
        visit(cdt_.infinite_face(), kOutside);
        while (!open_.empty()) {
            const auto [face, label] = open_.back();
            open_.pop_back();
            if (label != kOutside) add(face, label);
            for (int k = 0; k < 3; ++k) cross(face, k, label);
        }
        return std::move(result_);
    }

private:
    static constexpr int kOutside = -1;

    void constrain(std::uint32_t a, std::uint32_t b)
    {
        if (vertex_[a] != vertex_[b]) cdt_.insert_constraint(vertex_[a], vertex_[b]);
    }

    void visit(Face face, int label)
    {
        if (label_.emplace(face, label).second) open_.push_back({face, label});
    }

    void cross(Face face, int k, int label)
    {
        const Face next = face->neighbor(k);
        if (!face->is_constrained(k)) return visit(next, label);
        const std::uint32_t a = face->vertex(Triangulation::cw(k))->info().value;
        const std::uint32_t b = face->vertex(Triangulation::ccw(k))->info().value;
        const auto edge = outline_.find(std::minmax(a, b));
        if (edge == outline_.end()) {
            if (label != kOutside) visit(next, 1 - label);
            return;
        }
        visit(next, label == kOutside ? edge->second : kOutside);
    }

    void add(Face face, int label)
    {
        const std::array<std::uint32_t, 3> t{face->vertex(0)->info().value, face->vertex(1)->info().value,
                                             face->vertex(2)->info().value};
        if (std::find(t.begin(), t.end(), kNew) != t.end()) return;
        result_.triangles.push_back(t);
        result_.label.push_back(std::uint8_t(label));
    }

    const PlanarPolygon& polygon_;
    Triangulation cdt_;
    std::vector<Triangulation::Vertex_handle> vertex_;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint8_t> outline_;
    std::map<Face, int> label_;
    std::vector<std::pair<Face, int>> open_;
    PlanarTriangles result_;
};

}  // namespace

std::array<double, 2> flattened(const Vec3& X, const Vec3& normal)
{
    int axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    const double u = X[(axis + 1) % 3], v = X[(axis + 2) % 3];
    return normal[axis] > 0 ? std::array{u, v} : std::array{v, u};
}

std::vector<std::uint32_t> inOrder(std::vector<std::pair<double, std::uint32_t>> placed, bool turned)
{
    std::sort(placed.begin(), placed.end());
    if (turned) std::reverse(placed.begin(), placed.end());
    std::vector<std::uint32_t> order;
    for (const auto& p : placed) order.push_back(p.second);
    return order;
}

void PlanarPolygon::goRound(const std::vector<std::uint32_t>& round, const std::vector<std::uint8_t>& labels)
{
    for (std::size_t i = 0; i < round.size(); ++i) outline.push_back({round[i], round[(i + 1) % round.size()]});
    label.insert(label.end(), labels.begin(), labels.end());
}

PlanarTriangles triangulate(const PlanarPolygon& polygon) { return Divider(polygon).run(); }

namespace {

Vec3 areaVector(std::span<const Vec3> corners)
{
    return .5 * doubleArea(corners.size(), [&](std::size_t k) { return corners[k]; });
}

}  // namespace

bool isConvex(std::span<const Vec3> corners)
{
    constexpr double kStraight = 1e-9;  // sine of the angle between two edges
    const std::size_t n = corners.size();
    if (n <= 3) return true;
    const Vec3 normal = areaVector(corners).stableNormalized();
    for (std::size_t k = 0; k < n; ++k) {
        const Vec3 in = corners[(k + 1) % n] - corners[k], out = corners[(k + 2) % n] - corners[(k + 1) % n];
        if (!(in.cross(out).dot(normal) > kStraight * in.norm() * out.norm())) return false;
    }
    return true;
}

std::vector<std::array<std::uint32_t, 3>> polygonTriangles(std::span<const Vec3> corners)
{
    const auto n = std::uint32_t(corners.size());
    const Vec3 normal = areaVector(corners);
    PlanarPolygon polygon;
    std::vector<std::uint32_t> round;
    for (std::uint32_t k = 0; k < n; ++k) polygon.points.push_back(flattened(corners[k], normal)), round.push_back(k);
    polygon.goRound(round, std::vector<std::uint8_t>(n, 0));
    PlanarTriangles divided = triangulate(polygon);
    if (divided.isSound && divided.triangles.size() + 2 == n) return std::move(divided.triangles);
    std::vector<std::array<std::uint32_t, 3>> fan;
    for (std::uint32_t k = 2; k < n; ++k) fan.push_back({0, k - 1, k});
    return fan;
}

}  // namespace vdbfrac::tetmesh
