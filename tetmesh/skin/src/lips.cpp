#include "lips.h"

#include "planar.h"

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/base/triangle.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace vdbfrac::skin {

namespace {

constexpr double kFarthest = 1.5;  // voxels that a lip moves: more is no gap that a crack has made

/// The triangles of the outer surface in and beside cracks, by voxel.
class SkinNearCracks {
public:
    SkinNearCracks(const SkinTopology& skin, const CrackLattice& lattice) : skin_(skin), dx_(lattice.voxelSize())
    {
        for (std::uint32_t t = 0; t < skin.triangles.size(); ++t)
            forVoxels(skin, t, lattice, [&](Coord voxel) {
                if (lattice.isMixed(voxel) || lattice.isOpen(voxel)) entries_.emplace_back(voxel, t);
            });
        std::sort(entries_.begin(), entries_.end());
    }

    /// The triangles near a point of the surface that have the smooth face that it was on, or its sharp edge.
    struct Face {
        std::optional<Coord> voxel;  // in which the point was then
        std::vector<std::uint32_t> triangles;
    };
    /// The closest point of that face, or of its sharp edges where it was on one; where it is itself when there is none
    /// near. `face`: as it was before, of the same point.
    Vec3 closest(const SkinCut::Point& point, Face& face) const
    {
        const Vec3& X = point.X;
        const bool sharp = point.onEdge && skin_.isSharp[point.skin];
        if (const Coord voxel = tetmesh::floorOf(X / dx_); face.voxel != voxel) face = {voxel, faceNear(point, sharp)};
        Vec3 best = X;
        double nearest = std::numeric_limits<double>::infinity();
        const auto keep = [&](const Vec3& p) {
            if (const double d = (p - X).squaredNorm(); d < nearest) nearest = d, best = p;
        };
        for (const std::uint32_t t : face.triangles)
            if (sharp)
                visitEdges(t, X, keep);
            else
                visit(t, X, keep);
        return best;
    }

    /// X, or the closest point of the surface if X is outside of it and it is near.
    Vec3 inside(const Vec3& X) const
    {
        constexpr double kSame = 1e-9;  // relative: at an edge the triangles on both sides are as near
        Vec3 best = X;
        double nearest = std::numeric_limits<double>::infinity(), outwards = 0, most = 0;
        forNear(X, [&](std::uint32_t t) {
            visit(t, X, [&](const Vec3& p) {
                const double d = (p - X).squaredNorm(), out = (X - p).dot(skin_.normal[t]);
                if (d > nearest * (1 + kSame)) return;
                if (d < nearest * (1 - kSame)) most = 0;
                if (std::abs(out) >= most) most = std::abs(out), outwards = out;
                if (d < nearest) nearest = d, best = p;
            });
        });
        return outwards > 0 ? best : X;
    }

private:
    std::vector<std::uint32_t> faceNear(const SkinCut::Point& point, bool sharp) const
    {
        const Vec3& normal = point.onEdge ? skin_.edgeNormal[point.skin] : skin_.normal[point.skin];
        const auto hasSharp = [&](std::uint32_t t) {
            const auto& edges = skin_.edgeOf[t];
            return std::any_of(edges.begin(), edges.end(), [&](std::uint32_t e) { return bool(skin_.isSharp[e]); });
        };
        std::vector<std::uint32_t> face;
        forNear(point.X, [&](std::uint32_t t) {
            if (sharp ? hasSharp(t) : skin_.normal[t].dot(normal) >= kSameFace) face.push_back(t);
        });
        sortUnique(face);
        return face;
    }
    template <class Visit>
    void forNear(const Vec3& X, const Visit& visit) const
    {
        const Coord middle = tetmesh::floorOf(X / dx_);
        for (int z = -1; z <= 1; ++z)
            for (int y = -1; y <= 1; ++y)
                for (int x = -1; x <= 1; ++x) {
                    const Coord voxel = middle + Coord{x, y, z};
                    auto at = std::lower_bound(entries_.begin(), entries_.end(), std::pair{voxel, std::uint32_t(0)});
                    for (; at != entries_.end() && at->first == voxel; ++at) visit(at->second);
                }
    }
    template <class Keep>
    void visit(std::uint32_t t, const Vec3& X, const Keep& keep) const
    {
        const auto& c = skin_.triangles[t];
        keep(closestPoint({skin_.points[c[0]], skin_.points[c[1]], skin_.points[c[2]]}, X).at);
    }
    template <class Keep>
    void visitEdges(std::uint32_t t, const Vec3& X, const Keep& keep) const
    {
        const auto& c = skin_.triangles[t];
        for (std::size_t k = 0; k < 3; ++k)
            if (skin_.isSharp[skin_.edgeOf[t][k]]) {
                const Vec3 &a = skin_.points[c[k]], &b = skin_.points[c[(k + 1) % 3]];
                keep(closestPoint({a, b, b}, X).at);
            }
    }
    const SkinTopology& skin_;
    double dx_;
    std::vector<std::pair<Coord, std::uint32_t>> entries_;
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

/// Neighbours of points along torn faces: those of point i in next[start[i]] to next[start[i + 1]].
struct Neighbours {
    std::vector<std::uint32_t> start, next;
};
Neighbours neighboursOf(const SkinCut& cut, std::uint32_t firstPoint)
{
    Neighbours n;
    n.start.assign(cut.points.size() + 1, 0);
    for (const auto& t : cut.torn)
        for (std::uint32_t p : t) n.start[p - firstPoint + 1] += 2;
    for (std::size_t i = 0; i < cut.points.size(); ++i) n.start[i + 1] += n.start[i];
    n.next.resize(n.start.back());
    std::vector<std::uint32_t> at(n.start.begin(), n.start.end() - 1);
    for (const auto& t : cut.torn)
        for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t d = 1; d < 3; ++d) n.next[at[t[k] - firstPoint]++] = t[(k + d) % 3] - firstPoint;
    return n;
}

/// Each way becomes the mean of it and of those round it; points without one take that of their neighbours.
std::vector<std::optional<Vec3>> evened(const std::vector<std::optional<Vec3>>& way, const Neighbours& neighbours)
{
    std::vector<std::optional<Vec3>> result(way.size());
    parallelChunks(way.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            Vec3 sum = Vec3::Zero();
            int count = 0;
            for (std::uint32_t k = neighbours.start[i]; k < neighbours.start[i + 1]; ++k)
                if (const auto& other = way[neighbours.next[k]]) sum += *other, ++count;
            if (count == 0)
                result[i] = way[i];
            else
                result[i] = way[i] ? 0.5 * (*way[i] + sum / count) : Vec3(sum / count);
        }
    });
    return result;
}

/// Of neighbours along torn faces those that a point is faired by: of one on the rim only those along it.
Neighbours fairedBy(const SkinCut& cut, const Neighbours& all)
{
    Neighbours n;
    n.start.push_back(0);
    for (std::size_t i = 0; i < cut.points.size(); ++i) {
        std::vector<std::uint32_t> round(all.next.begin() + all.start[i], all.next.begin() + all.start[i + 1]);
        std::sort(round.begin(), round.end());
        const bool isRim = cut.points[i].skin != SkinCut::kNoSkin;
        for (auto at = round.begin(); at != round.end();) {
            const auto end = std::upper_bound(at, round.end(), *at);
            if (!isRim || end - at == 1) n.next.push_back(*at);  // an edge of one triangle alone is on the rim
            at = end;
        }
        n.start.push_back(std::uint32_t(n.next.size()));
    }
    return n;
}

/// Takes off what is left of the voxels. Each point goes towards the mean of those round it, and in torn faces away
/// from it again, which evens what is short and keeps what is long (Taubin 1995); rims would keep their small loops.
void fair(const Neighbours& neighbours, const SkinNearCracks& near, std::vector<SkinCut::Point>& points)
{
    constexpr int kRounds = 15;  // with points half a voxel apart: .02 is left of what is 2 voxels long, .8 of 4
    constexpr double kTowards = 0.5, kAway = -0.53;
    std::vector<Vec3> moved(points.size());
    std::vector<SkinNearCracks::Face> face(points.size());
    for (int half = 0; half < 2 * kRounds; ++half) {
        const double inFace = half % 2 == 0 ? kTowards : kAway;
        parallelChunks(points.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                SkinCut::Point p = points[i];
                const bool isRim = p.skin != SkinCut::kNoSkin;
                Vec3 sum = Vec3::Zero();
                for (std::uint32_t k = neighbours.start[i]; k < neighbours.start[i + 1]; ++k)
                    sum += points[neighbours.next[k]].X;
                if (const std::uint32_t count = neighbours.start[i + 1] - neighbours.start[i]; count > 0)
                    p.X += (isRim ? kTowards : inFace) * (sum / count - p.X);
                moved[i] = isRim ? near.closest(p, face[i]) : p.X;
            }
        });
        for (std::size_t i = 0; i < points.size(); ++i) points[i].X = moved[i];
    }
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

    /// Parts that hang together by edges.
    static std::vector<Parts> piecesOf(std::span<const SkinCut::Part> parts)
    {
        std::vector<std::size_t> label(parts.size());
        for (std::size_t i = 0; i < parts.size(); ++i) label[i] = i;
        for (bool changed = true; changed;) {
            changed = false;
            for (std::size_t i = 0; i < parts.size(); ++i)
                for (std::size_t j = 0; j < i; ++j)
                    if (label[i] != label[j] && shareEdge(parts[i], parts[j]))
                        label[i] = label[j] = std::min(label[i], label[j]), changed = true;
        }
        std::vector<Parts> pieces;
        for (std::size_t root = 0; root < parts.size(); ++root) {
            Parts piece;
            for (std::size_t i = 0; i < parts.size(); ++i)
                if (label[i] == root) piece.push_back(parts[i]);
            if (!piece.empty()) pieces.push_back(std::move(piece));
        }
        return pieces;
    }
    static bool shareEdge(const SkinCut::Part& a, const SkinCut::Part& b)
    {
        int shared = 0;
        for (std::uint32_t p : a.corner) shared += std::find(b.corner.begin(), b.corner.end(), p) != b.corner.end();
        return shared == 2;
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
    static std::vector<std::pair<std::uint32_t, std::uint32_t>> borderOf(const Parts& piece)
    {
        std::vector<std::pair<std::uint32_t, std::uint32_t>> all;
        for (const SkinCut::Part& p : piece)
            for (std::size_t k = 0; k < 3; ++k) all.emplace_back(p.corner[k], p.corner[(k + 1) % 3]);
        std::vector<std::pair<std::uint32_t, std::uint32_t>> border;
        for (const auto& [a, b] : all)
            if (std::find(all.begin(), all.end(), std::pair{b, a}) == all.end()) border.emplace_back(a, b);
        std::sort(border.begin(), border.end());
        return border;
    }

    const SkinTopology& skin_;
    SkinCut& cut_;
};

}  // namespace

void closeLips(const SkinTopology& skin, const CrackLattice& lattice, SkinCut& cut)
{
    constexpr int kRounds = 3;
    const SkinNearCracks near(skin, lattice);
    std::vector<std::optional<Vec3>> way(cut.points.size());
    parallelChunks(way.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) way[i] = halfWay(lattice, cut.points[i].X);
    });
    const Neighbours neighbours = neighboursOf(cut, std::uint32_t(skin.pointOf.size()));
    for (int round = 0; round < kRounds; ++round) way = evened(way, neighbours);
    for (std::size_t i = 0; i < way.size(); ++i)
        if (way[i]) cut.points[i].X += *way[i];
    fair(fairedBy(cut, neighbours), near, cut.points);
    parallelChunks(cut.points.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            if (SkinCut::Point& p = cut.points[i]; p.skin == SkinCut::kNoSkin) p.X = near.inside(p.X);
    });
    Redivider(skin, cut).run();
}

}  // namespace vdbfrac::skin
