#include "lips.h"

#include "planar.h"

#include <vdbfrac/base/parallel.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace vdbfrac::skin {

namespace {

constexpr double kFarthest = 1.5;  // voxels that a lip moves: more is no gap that a crack has made
constexpr double kSharp =
    0.87;  // cosine of the angle between the triangles of an edge that is no part of a smooth face

Coord voxelOf(const Vec3& X, double dx)
{
    return {int(std::floor(X.x() / dx)), int(std::floor(X.y() / dx)), int(std::floor(X.z() / dx))};
}

/// The closest point of a triangle. Source: Ericson, Real-Time Collision Detection (2005), 5.1.5.
Vec3 closestOn(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p)
{
    const Vec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
    const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp), d6 = ac.dot(cp);
    if (d1 <= 0 && d2 <= 0) return a;
    if (d3 >= 0 && d4 <= d3) return b;
    if (d6 >= 0 && d5 <= d6) return c;
    const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
    const double sum = va + vb + vc;
    return sum > 0 ? Vec3(a + vb / sum * ab + vc / sum * ac) : a;
}

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
        findSharpEdges();
    }

    /// The closest point of the smooth face that a point of the surface was on, or of its sharp edges where it was on
    /// one; where it is itself when there is none near.
    Vec3 closest(const SkinCut::Point& point) const
    {
        const Vec3& X = point.X;
        const bool sharp = point.onEdge && isSharp_[point.skin];
        const Vec3& normal = point.onEdge ? edgeNormal_[point.skin] : normal_[point.skin];
        Vec3 best = X;
        double nearest = std::numeric_limits<double>::infinity();
        const auto keep = [&](const Vec3& p) {
            if (const double d = (p - X).squaredNorm(); d < nearest) nearest = d, best = p;
        };
        const Coord middle = voxelOf(X, dx_);
        for (int z = -1; z <= 1; ++z)
            for (int y = -1; y <= 1; ++y)
                for (int x = -1; x <= 1; ++x) {
                    const Coord voxel = middle + Coord{x, y, z};
                    auto at = std::lower_bound(entries_.begin(), entries_.end(), std::pair{voxel, std::uint32_t(0)});
                    for (; at != entries_.end() && at->first == voxel; ++at) {
                        if (sharp)
                            visitEdges(at->second, X, keep);
                        else if (normal_[at->second].dot(normal) >= kSharp)
                            visit(at->second, X, keep);
                    }
                }
        return best;
    }

private:
    template <class Keep>
    void visit(std::uint32_t t, const Vec3& X, const Keep& keep) const
    {
        const auto& c = skin_.triangles[t];
        keep(closestOn(skin_.points[c[0]], skin_.points[c[1]], skin_.points[c[2]], X));
    }
    template <class Keep>
    void visitEdges(std::uint32_t t, const Vec3& X, const Keep& keep) const
    {
        const auto& c = skin_.triangles[t];
        for (std::size_t k = 0; k < 3; ++k)
            if (isSharp_[skin_.edgeOf[t][k]]) {
                const Vec3 &a = skin_.points[c[k]], &b = skin_.points[c[(k + 1) % 3]];
                keep(closestOn(a, b, b, X));
            }
    }
    void findSharpEdges()
    {
        edgeNormal_.assign(skin_.edges.size(), Vec3::Zero());
        isSharp_.assign(skin_.edges.size(), false);
        for (std::size_t t = 0; t < skin_.triangles.size(); ++t) {
            const auto& c = skin_.triangles[t];
            normal_.push_back((skin_.points[c[1]] - skin_.points[c[0]])
                                  .cross(skin_.points[c[2]] - skin_.points[c[0]])
                                  .stableNormalized());
            for (std::uint32_t e : skin_.edgeOf[t]) {
                if (edgeNormal_[e].isZero())
                    edgeNormal_[e] = normal_[t];
                else
                    isSharp_[e] = edgeNormal_[e].dot(normal_[t]) < kSharp;
            }
        }
    }

    const SkinTopology& skin_;
    double dx_;
    std::vector<std::pair<Coord, std::uint32_t>> entries_;
    std::vector<Vec3> normal_, edgeNormal_;  // of triangles, and of the first triangle at each edge
    std::vector<bool> isSharp_;              // of each edge
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
    for (double s = kStep; s <= 2 * kFarthest; s += kStep) {
        const bool open = lattice.smoothC(X + s * dx * out) > 0;
        if (entered && !open) {
            if (outwards(X + s * dx * out).dot(out) > kOpposite) return std::nullopt;
            return 0.5 * s * dx * out;
        }
        entered = entered || open;
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

/// Divides what triangles keep anew, after its points have moved: a division that was good may fold over.
class Redivider {
public:
    Redivider(const SkinTopology& skin, std::span<const std::array<std::uint32_t, 3>> triangles, SkinCut& cut)
        : skin_(skin), triangles_(triangles), cut_(cut)
    {
    }
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
        std::vector<std::uint32_t> names;
        PlanarPolygon polygon;
        const auto numberOf = [&](std::uint32_t point) {
            const auto at = std::find(names.begin(), names.end(), point);
            if (at != names.end()) return std::uint32_t(at - names.begin());
            names.push_back(point);
            polygon.points.push_back(flattened(place(point), normal));
            return std::uint32_t(names.size() - 1);
        };
        for (const auto& [a, b] : borderOf(piece)) {
            polygon.outline.push_back({numberOf(a), numberOf(b)});
            polygon.label.push_back(0);
        }
        const PlanarTriangles divided = triangulate(polygon);
        Parts now;
        for (const auto& d : divided.triangles)
            now.push_back({piece[0].triangle, {names[d[0]], names[d[1]], names[d[2]]}});
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
    std::span<const std::array<std::uint32_t, 3>> triangles_;
    SkinCut& cut_;
};

}  // namespace

void closeLips(const SkinTopology& skin, const CrackLattice& lattice,
               std::span<const std::array<std::uint32_t, 3>> triangles, SkinCut& cut)
{
    constexpr int kRounds = 3;
    const SkinNearCracks near(skin, lattice);
    std::vector<std::optional<Vec3>> way(cut.points.size());
    parallelChunks(way.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) way[i] = halfWay(lattice, cut.points[i].X);
    });
    const Neighbours neighbours = neighboursOf(cut, std::uint32_t(skin.pointOf.size()));
    for (int round = 0; round < kRounds; ++round) way = evened(way, neighbours);
    parallelChunks(way.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            SkinCut::Point& p = cut.points[i];
            if (!way[i]) continue;
            p.X += *way[i];
            if (p.skin != SkinCut::kNoSkin) p.X = near.closest(p);
        }
    });
    Redivider(skin, triangles, cut).run();
}

}  // namespace vdbfrac::skin
