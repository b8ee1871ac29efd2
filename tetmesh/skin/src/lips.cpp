#include "lips.h"

#include "by_voxel.h"
#include "fairing.h"
#include "slider.h"

#include <vdbfrac/skin/opposite.h>

#include <vdbfrac/base/disjoint_sets.h>
#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/base/triangle.h>
#include <vdbfrac/tetmesh/planar.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace vdbfrac::skin {

using tetmesh::NamedPolygon;
using tetmesh::PlanarPolygon;
using tetmesh::PlanarTriangles;
using tetmesh::triangulate;

namespace {

constexpr double kFarthest = 1.5;  // voxels that a lip moves: more is no gap that a crack has made

/// The triangles of the outer surface in and beside cracks, by voxel.
class SkinNearCracks {
public:
    SkinNearCracks(const SkinTopology& skin, const CrackLattice& lattice) : skin_(skin), dx_(lattice.voxelSize())
    {
        for (std::uint32_t t = 0; t < skin.triangles.size(); ++t)
            forVoxels(skin, t, lattice, [&](Coord voxel) {
                if (lattice.isMixed(voxel) || lattice.isOpen(voxel)) byVoxel_.add(voxel, t);
            });
        byVoxel_.sort();
    }

    /// How deep X lies below the surface [m], up to `most`; 0 outside of it.
    double depth(const Vec3& X, double most) const
    {
        const std::optional<Foot> foot = closest(X);
        if (!foot) return most;
        return foot->isOutside ? 0 : std::min(most, (X - foot->at).norm());
    }
    /// X, or a point near to it that is no less deep than this [m].
    Vec3 inside(const Vec3& X, double depth) const
    {
        const std::optional<Foot> foot = closest(X);
        if (!foot || (!foot->isOutside && (X - foot->at).norm() >= depth)) return X;
        return foot->at - depth * foot->normal;
    }

private:
    struct Foot {
        Vec3 at, normal;  // of the surface there
        bool isOutside;   // is X?
    };

    /// The closest point of the surface, if it is near.
    std::optional<Foot> closest(const Vec3& X) const
    {
        constexpr double kSame = 1e-9;  // relative: at an edge the triangles on both sides are as near
        Foot foot{X, Vec3::Zero(), false};
        double nearest = std::numeric_limits<double>::infinity(), most = 0;
        forNear(X, [&](std::uint32_t t) {
            if (leastSquare(t, X) > nearest * (1 + kSame)) return;
            const Vec3 p = closestPoint(skin_.corners(t), X).at;
            const double d = (p - X).squaredNorm(), out = (X - p).dot(skin_.normal[t]);
            if (d > nearest * (1 + kSame)) return;
            if (d < nearest * (1 - kSame)) most = 0;
            if (std::abs(out) >= most) most = std::abs(out), foot.isOutside = out > 0, foot.normal = skin_.normal[t];
            if (d < nearest) nearest = d, foot.at = p;
        });
        return nearest < std::numeric_limits<double>::infinity() ? std::optional(foot) : std::nullopt;
    }
    template <class Visit>
    void forNear(const Vec3& X, const Visit& visit) const
    {
        const Coord middle = tetmesh::floorOf(X / dx_), one{1, 1, 1};
        byVoxel_.visit(middle - one, middle + one, visit);
    }
    /// No point of a triangle is nearer to X than this; squared.
    double leastSquare(std::uint32_t t, const Vec3& X) const
    {
        const auto [p, q, r] = skin_.corners(t);
        const Vec3 gap = (p.cwiseMin(q).cwiseMin(r) - X).cwiseMax(X - p.cwiseMax(q).cwiseMax(r)).cwiseMax(0);
        return gap.squaredNorm();
    }
    const SkinTopology& skin_;
    double dx_;
    ByVoxel byVoxel_;
};

/// Half the way from a lip to the one opposite; none where nothing is opposite.
std::optional<Vec3> halfWay(const CrackLattice& lattice, const Vec3& X)
{
    constexpr double kStep = 0.1, kLip = 0.6;  // voxels: of the search, and until it must have left the lip
    constexpr double kOpposite = -0.3;         // cosine between the directions in which two lips look
    const double dx = lattice.voxelSize();
    const auto outwards = [&](const Vec3& at) {
        Vec3 slope;
        for (int k = 0; k < 3; ++k)
            slope[k] = lattice.smoothC(at + 0.5 * dx * Vec3::Unit(k)) - lattice.smoothC(at - 0.5 * dx * Vec3::Unit(k));
        return Vec3(slope.stableNormalized());
    };
    const Vec3 out = outwards(X);
    bool entered = false;
    double before = 0;
    for (double s = kStep; s <= 2 * kFarthest; s += kStep) {
        const double c = lattice.smoothC(X + s * dx * out);
        if (entered && !(c > 0)) {
            if (outwards(X + s * dx * out).dot(out) > kOpposite) return std::nullopt;
            return 0.5 * (s - kStep * c / (c - before)) * dx * out;
        }
        entered = entered || c > 0;
        before = c;
        if (!entered && s > kLip) return std::nullopt;
    }
    return std::nullopt;
}

/// Each way becomes the mean of it and of those round it; points without one take that of their neighbours.
std::vector<std::optional<Vec3>> evened(const std::vector<std::optional<Vec3>>& way, const Groups& neighbours)
{
    std::vector<std::optional<Vec3>> result(way.size());
    parallelChunks(way.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            Vec3 sum = Vec3::Zero();
            int count = 0;
            for (const std::uint32_t next : neighbours[i])
                if (const auto& other = way[next]) sum += *other, ++count;
            if (count == 0)
                result[i] = way[i];
            else
                result[i] = way[i] ? 0.5 * (*way[i] + sum / count) : Vec3(sum / count);
        }
    });
    return result;
}

/// Divides what triangles keep anew, after its points have moved: a division that was good may fold over.
class Redivider {
public:
    Redivider(const SkinTopology& skin, SkinCut& cut) : skin_(skin), cut_(cut) {}
    void run()
    {
        const std::vector<SkinCut::Part> parts = std::move(cut_.parts);
        cut_.parts.clear();
        for (std::size_t begin = 0, end = 0; begin < parts.size(); begin = end) {
            while (end < parts.size() && parts[end].triangle == parts[begin].triangle) ++end;
            for (const auto& piece : piecesOf({parts.data() + begin, parts.data() + end})) redivide(piece);
        }
    }

private:
    using Parts = std::vector<SkinCut::Part>;

    using Edge = std::pair<std::uint32_t, std::uint32_t>;

    /// Parts that hang together by edges, by their first.
    static std::vector<Parts> piecesOf(std::span<const SkinCut::Part> parts)
    {
        std::vector<std::pair<Edge, std::uint32_t>> edges;
        for (std::uint32_t i = 0; i < parts.size(); ++i)
            for (std::size_t k = 0; k < 3; ++k)
                edges.emplace_back(std::minmax(parts[i].corner[k], parts[i].corner[(k + 1) % 3]), i);
        std::sort(edges.begin(), edges.end());
        DisjointSets sets(parts.size());
        for (std::size_t e = 1; e < edges.size(); ++e)
            if (edges[e].first == edges[e - 1].first) sets.join(edges[e].second, edges[e - 1].second);
        const std::vector<std::uint32_t> first = std::move(sets).names();
        std::vector<Parts> ofFirst(parts.size());
        for (std::size_t i = 0; i < parts.size(); ++i) ofFirst[first[i]].push_back(parts[i]);
        std::erase_if(ofFirst, [](const Parts& piece) { return piece.empty(); });
        return ofFirst;
    }

    Vec3 place(std::uint32_t point) const
    {
        const std::size_t given = skin_.pointOf.size();
        return point < given ? skin_.points[skin_.pointOf[point]] : cut_.points[point - given].X;
    }

    void redivide(const Parts& piece)
    {
        const auto& t = skin_.triangles[piece[0].triangle];
        const Vec3 normal = (skin_.points[t[1]] - skin_.points[t[0]]).cross(skin_.points[t[2]] - skin_.points[t[0]]);
        NamedPolygon<std::uint32_t> named(normal);
        const auto numberOf = [&](std::uint32_t point) { return named.number(point, place(point)); };
        PlanarPolygon& polygon = named.polygon;
        for (const auto& [a, b] : borderOf(piece)) {
            polygon.outline.push_back({numberOf(a), numberOf(b)});
            polygon.label.push_back(0);
        }
        const PlanarTriangles divided = triangulate(polygon);
        Parts now;
        for (const auto& d : divided.triangles) now.push_back({piece[0].triangle, named.names(d)});
        // Where the border crosses itself the division stays as it was.
        const Parts& kept = divided.isSound && borderOf(now) == borderOf(piece) ? now : piece;
        cut_.parts.insert(cut_.parts.end(), kept.begin(), kept.end());
    }
    /// Directed edges of one part only, sorted.
    static std::vector<Edge> borderOf(const Parts& piece)
    {
        std::vector<Edge> all;
        for (const SkinCut::Part& p : piece)
            for (std::size_t k = 0; k < 3; ++k) all.emplace_back(p.corner[k], p.corner[(k + 1) % 3]);
        std::sort(all.begin(), all.end());
        std::vector<Edge> border;
        for (const auto& [a, b] : all)
            if (!std::binary_search(all.begin(), all.end(), Edge(b, a))) border.emplace_back(a, b);
        return border;
    }

    const SkinTopology& skin_;
    SkinCut& cut_;
};

/// Moves points of torn faces and rims to the middle between them and the lip opposite, as each lip has been made fair
/// by itself: rims, which are seen before the crack opens, until they lie on each other. `triangle`: as fair() returns
/// it.
void meet(const SkinTopology& skin, double dx, std::vector<std::uint32_t> triangle, SkinCut& cut)
{
    constexpr int kRounds = 4;
    const auto first = std::uint32_t(skin.pointOf.size());
    std::vector<std::array<std::uint32_t, 3>> torn;
    for (const auto& [a, b, c] : cut.torn) torn.push_back({a - first, b - first, c - first});
    const Slider slider(skin);
    std::vector<Vec3> X, normal;
    for (const SkinCut::Point& point : cut.points) {
        X.push_back(point.X);
        normal.push_back(slider.normalAt(point));
    }
    const auto goHalfWay = [&](const std::vector<Opposite>& lips) {
        std::vector<Vec3> middle(lips.size());
        parallelChunks(lips.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const std::uint32_t p = lips[i].point;
                middle[i] = 0.5 * (X[p] + lips[i].at(X));
                if (!normal[p].isZero()) middle[i] = slider.closest(cut.points[p], middle[i], triangle[p]);
            }
        });
        for (std::size_t i = 0; i < lips.size(); ++i) X[lips[i].point] = middle[i];
    };
    goHalfWay(oppositeFaces(X, torn, normal, dx));
    for (int round = 0; round < kRounds; ++round) goHalfWay(oppositeRims(X, torn, normal, dx));
    for (std::size_t i = 0; i < X.size(); ++i) cut.points[i].X = X[i];
}

}  // namespace

void closeLips(const SkinTopology& skin, const CrackLattice& lattice, SkinCut& cut)
{
    constexpr int kRounds = 3, kUnfolded = 20;
    constexpr double kDepth = 0.1;  // voxels: what lies under the outer surface stays under it
    const SkinNearCracks near(skin, lattice);
    std::vector<std::optional<Vec3>> way(cut.points.size());
    std::vector<double> depth(cut.points.size());  // of those that are not on the outer surface
    parallelChunks(way.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            way[i] = halfWay(lattice, cut.points[i].X);
            if (cut.points[i].skin != SkinCut::kNoSkin) continue;
            depth[i] = near.depth(cut.points[i].X, kDepth * lattice.voxelSize());
        }
    });
    const Groups neighbours = neighboursOf(cut, std::uint32_t(skin.pointOf.size()));
    for (int round = 0; round < kRounds; ++round) way = evened(way, neighbours);
    for (std::size_t i = 0; i < way.size(); ++i)
        if (way[i]) cut.points[i].X += *way[i];
    meet(skin, lattice.voxelSize(), fair(skin, neighbours, lattice.voxelSize(), cut.points), cut);
    std::vector<std::uint32_t> moved;
    for (std::uint32_t i = 0; i < cut.points.size(); ++i)
        if (cut.points[i].skin == SkinCut::kNoSkin) moved.push_back(i);
    for (int round = 0;; ++round) {
        parallelChunks(moved.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
            for (std::size_t m = begin; m < end; ++m)
                cut.points[moved[m]].X = near.inside(cut.points[moved[m]].X, depth[moved[m]]);
        });
        if (round == kUnfolded) break;
        moved = unfold(neighbours, std::uint32_t(skin.pointOf.size()), cut);
        if (moved.empty()) break;
    }
    Redivider(skin, cut).run();
}

}  // namespace vdbfrac::skin
