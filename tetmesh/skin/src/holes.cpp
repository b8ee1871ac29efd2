#include <vdbfrac/skin/holes.h>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/utility.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <map>
#include <utility>

namespace vdbfrac::skin {

namespace {

using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;
using DirectedEdge = std::pair<std::uint32_t, std::uint32_t>;
using Chain = std::vector<std::uint32_t>;  // points

/// Edges of faces that are or are not torn, as these run; sorted.
std::vector<DirectedEdge> edgesOf(const tetmesh::DrawnTopology& drawn, bool torn)
{
    std::vector<DirectedEdge> edges;
    for (std::size_t f = 0; f < drawn.mesh.faces(); ++f) {
        if ((drawn.torn[f] != 0) != torn) continue;
        const auto corners = drawn.mesh.face(f);
        for (std::size_t k = 0; k < corners.size(); ++k)
            edges.emplace_back(corners[k].point, corners[(k + 1) % corners.size()].point);
    }
    std::sort(edges.begin(), edges.end());
    return edges;
}

/// From each point of a rim to the next one, as outer faces run along it, where an end lies on no other lip.
std::map<std::uint32_t, std::uint32_t> openRims(const tetmesh::DrawnTopology& drawn,
                                                std::span<const std::uint8_t> isJoined)
{
    const std::vector<DirectedEdge> torn = edgesOf(drawn, true);
    std::map<std::uint32_t, std::uint32_t> next;
    for (const auto& [a, b] : torn.empty() ? torn : edgesOf(drawn, false))
        if (!(isJoined[a] && isJoined[b]) && std::binary_search(torn.begin(), torn.end(), DirectedEdge(b, a)))
            next.emplace(a, b);
    return next;
}

/// Closed chains end where they begin.
std::vector<Chain> chainsOf(std::map<std::uint32_t, std::uint32_t> next)
{
    std::map<std::uint32_t, int> comesIn;
    for (const auto& [a, b] : next) ++comesIn[b];
    std::vector<Chain> chains;
    const auto follow = [&](std::uint32_t first) {
        Chain chain = {first};
        for (auto at = next.find(first); at != next.end(); at = next.find(chain.back()))
            chain.push_back(at->second), next.erase(at);
        chains.push_back(std::move(chain));
    };
    std::vector<std::uint32_t> heads;
    for (const auto& [a, b] : next)
        if (!comesIn.contains(a)) heads.push_back(a);
    for (const std::uint32_t a : heads) follow(a);
    while (!next.empty()) follow(next.begin()->first);
    return chains;
}

/// Puts chains together that go on in each other, within a voxel, until they come round.
std::vector<Chain> loopsOf(std::vector<Chain> chains, std::span<const Vec3> X, double dx)
{
    constexpr double kNowhere = std::numeric_limits<double>::infinity();
    std::vector<Chain> loops;
    while (!chains.empty()) {
        Chain loop = std::move(chains.back());
        chains.pop_back();
        while (loop.front() != loop.back()) {
            const auto away = [&](std::uint32_t p) { return (X[p] - X[loop.back()]).norm(); };
            const auto nearest = std::ranges::min_element(chains, {}, [&](const Chain& c) { return away(c.front()); });
            const double here = away(loop.front()), there = nearest == chains.end() ? kNowhere : away(nearest->front());
            if (std::min(here, there) > dx) loop = {};  // it does not come round
            if (loop.empty() || here <= there) break;
            loop.insert(loop.end(), nearest->begin(), nearest->end());
            chains.erase(nearest);
        }
        if (!loop.empty() && loop.front() == loop.back()) loop.pop_back();
        if (loop.size() > 2) loops.push_back(std::move(loop));
    }
    return loops;
}

double lengthOf(const Chain& loop, std::span<const Vec3> X)
{
    double sum = (X[loop.front()] - X[loop.back()]).norm();
    for (std::size_t i = 1; i < loop.size(); ++i) sum += (X[loop[i]] - X[loop[i - 1]]).norm();
    return sum;
}

/// None where the points have no triangulation.
std::vector<std::array<std::uint32_t, 3>> coverOf(const Chain& rim, std::span<const Vec3> X)
{
    std::vector<Point> points;
    for (const std::uint32_t p : rim) points.emplace_back(X[p].x(), X[p].y(), X[p].z());
    std::vector<std::array<std::uint32_t, 3>> cover;
    std::vector<CGAL::Triple<std::uint32_t, std::uint32_t, std::uint32_t>> found;
    CGAL::Polygon_mesh_processing::triangulate_hole_polyline(points, std::back_inserter(found));
    // It runs along the rim as the polyline does, faces beside it too: so it has to be turned.
    for (const auto& t : found) cover.push_back({t.first, t.third, t.second});
    return cover;
}

}  // namespace

std::vector<Hole> holesOf(const tetmesh::DrawnTopology& drawn, std::span<const std::uint8_t> isJoined, double dx)
{
    constexpr double kRound = 2;  // voxels: holes with a shorter rim are seams that do not quite meet
    const std::vector<Vec3>& X = drawn.mesh.points;
    std::vector<Hole> holes;
    for (Chain& loop : loopsOf(chainsOf(openRims(drawn, isJoined)), X, dx)) {
        if (lengthOf(loop, X) < kRound * dx) continue;
        Hole hole{std::move(loop), {}};
        hole.cover = coverOf(hole.rim, X);
        if (!hole.cover.empty()) holes.push_back(std::move(hole));
    }
    return holes;
}

}  // namespace vdbfrac::skin
