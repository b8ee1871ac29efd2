#include <vdbfrac/tetmesh/surface_input.h>

#include <vdbfrac/base/polygon.h>

#include <algorithm>
#include <array>
#include <numeric>

namespace vdbfrac::tetmesh {

namespace {

/// Its points, the lower first, and whether the face goes from the lower to the higher.
struct Edge {
    std::size_t lower, higher;
    bool rises;

    bool operator<(const Edge& o) const { return lower != o.lower ? lower < o.lower : higher < o.higher; }
    bool isSame(const Edge& o) const { return lower == o.lower && higher == o.higher; }
};

void countEdges(std::vector<Edge>& edges, SurfaceReport& report)
{
    std::sort(edges.begin(), edges.end());
    for (auto run = edges.begin(); run != edges.end();) {
        const auto end = std::find_if(run, edges.end(), [&](const Edge& e) { return !e.isSame(*run); });
        report.openEdges += (end - run) % 2;
        report.nonManifoldEdges += end - run > 2;
        report.oriented =
            report.oriented && 2 * std::count_if(run, end, [](const Edge& e) { return e.rises; }) == end - run;
        run = end;
    }
}

bool repeats(const std::vector<std::size_t>& polygon, const std::vector<std::size_t>& first)
{
    std::vector<std::size_t> corners;
    for (std::size_t p : polygon) corners.push_back(first[p]);
    std::sort(corners.begin(), corners.end());
    return std::adjacent_find(corners.begin(), corners.end()) != corners.end();
}

}  // namespace

std::vector<std::size_t> equalPoints(std::span<const Vec3> points)
{
    struct Place {
        Vec3 X;
        std::size_t point;
    };
    std::vector<Place> order;
    order.reserve(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) order.push_back({points[i], i});
    std::sort(order.begin(), order.end(), [](const Place& a, const Place& b) {
        for (int k = 0; k < 3; ++k)
            if (a.X[k] != b.X[k]) return a.X[k] < b.X[k];
        return a.point < b.point;
    });
    std::vector<std::size_t> first(points.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        const std::size_t point = order[i].point;
        first[point] = i > 0 && order[i].X == order[i - 1].X ? first[order[i - 1].point] : point;
    }
    return first;
}

SurfaceReport examine(const PolygonSoup& soup)
{
    SurfaceReport report;
    if (soup.polygons.empty()) return report;
    const std::vector<std::size_t> first = equalPoints(soup.points);
    report.lower = report.upper = soup.points[soup.polygons[0][0]];
    std::vector<Edge> edges;
    for (const std::vector<std::size_t>& polygon : soup.polygons) {
        const auto at = [&](std::size_t k) -> const Vec3& { return soup.points[polygon[k]]; };
        const double area = 0.5 * doubleArea(polygon.size(), at).norm();
        report.degenerateFaces += area == 0 || repeats(polygon, first);
        report.area += area;
        report.volume += volumeBelow(polygon.size(), at);
        for (std::size_t c = 0; c < polygon.size(); ++c) {
            const std::size_t a = first[polygon[c]], b = first[polygon[(c + 1) % polygon.size()]];
            report.lower = report.lower.cwiseMin(soup.points[a]);
            report.upper = report.upper.cwiseMax(soup.points[a]);
            if (a != b) edges.push_back({std::min(a, b), std::max(a, b), a < b});
        }
    }
    report.oriented = !edges.empty();
    countEdges(edges, report);
    report.closed = report.openEdges == 0 && !edges.empty();
    return report;
}

}  // namespace vdbfrac::tetmesh
