#include <vdbfrac/skin/holes.h>

#include "by_voxel.h"

#include <vdbfrac/tetmesh/trilinear.h>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/utility.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

namespace vdbfrac::skin {

namespace {

using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;
using DirectedEdge = std::pair<std::uint32_t, std::uint32_t>;
using Chain = std::vector<std::uint32_t>;  // points
constexpr std::uint32_t kNoChain = 0xffffffff;

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

/// Which chain goes on where each ends, itself if it comes round: of all that are near, the nearest pairs first.
/// kNoChain: nothing goes on there.
std::vector<std::uint32_t> nextOf(std::span<const Chain> chains, std::span<const Vec3> X, double dx)
{
    constexpr double kApart = 3;  // voxels: what a chain may end away from where the next one begins
    ByVoxel begins;
    for (std::uint32_t i = 0; i < chains.size(); ++i) begins.add(tetmesh::floorOf(X[chains[i].front()] / dx), i);
    begins.sort();
    struct Pair {
        double distance;
        std::uint32_t ends, begins;
        auto operator<=>(const Pair&) const = default;
    };
    std::vector<Pair> pairs;
    for (std::uint32_t i = 0; i < chains.size(); ++i) {
        const Vec3& end = X[chains[i].back()];
        begins.visit(tetmesh::floorOf(end.array() / dx - kApart), tetmesh::floorOf(end.array() / dx + kApart),
                     [&](std::uint32_t k) {
                         const double d = (X[chains[k].front()] - end).norm();
                         if (d <= kApart * dx) pairs.push_back({d, i, k});
                     });
    }
    std::sort(pairs.begin(), pairs.end());
    std::vector<std::uint32_t> next(chains.size(), kNoChain), before(next);
    for (const Pair& p : pairs)
        if (next[p.ends] == kNoChain && before[p.begins] == kNoChain)
            next[p.ends] = p.begins, before[p.begins] = p.ends;
    return next;
}

struct Loop {
    Chain rim;
    bool comesRound = true;
};

std::vector<Loop> loopsOf(std::span<const Chain> chains, std::span<const Vec3> X, double dx)
{
    const std::vector<std::uint32_t> next = nextOf(chains, X, dx);
    std::vector<std::uint8_t> isFirst(chains.size(), 1), isDone(chains.size(), 0);
    for (const std::uint32_t n : next)
        if (n != kNoChain) isFirst[n] = 0;
    std::vector<Loop> loops;
    const auto follow = [&](std::uint32_t i) {
        Loop loop{{}, !isFirst[i]};
        for (; i != kNoChain && !isDone[i]; isDone[i] = 1, i = next[i])
            loop.rim.insert(loop.rim.end(), chains[i].begin(), chains[i].end());
        if (loop.rim.size() > 1 && loop.rim.front() == loop.rim.back()) loop.rim.pop_back();
        if (loop.rim.size() > 2) loops.push_back(std::move(loop));
    };
    for (const bool first : {true, false})
        for (std::uint32_t i = 0; i < chains.size(); ++i)
            if (isFirst[i] == first) follow(i);
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
    for (auto& [rim, comesRound] : loopsOf(chainsOf(openRims(drawn, isJoined)), X, dx)) {
        if (lengthOf(rim, X) < kRound * dx) continue;
        std::vector<std::array<std::uint32_t, 3>> cover;
        if (comesRound) cover = coverOf(rim, X);
        holes.push_back({std::move(rim), std::move(cover)});
    }
    return holes;
}

}  // namespace vdbfrac::skin
