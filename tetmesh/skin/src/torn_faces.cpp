#include "torn_faces.h"

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/planar.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

namespace vdbfrac::skin {

using tetmesh::inOrder;
using tetmesh::NamedPolygon;
using tetmesh::PlanarTriangles;
using tetmesh::triangulate;

namespace {

constexpr double kSure = 0.1;  // voxels beyond the offset of the surface: there phi at rest tells inside from outside

/// Which voxel nodes of cut tets lie inside the outer surface: by phi at rest where it is sure, else by counting the
/// triangles on the way to a node where it is.
class InnerNodes {
public:
    InnerNodes(const TornSource& source, std::span<const LatticeTet> tets) : source_(source)
    {
        for (const LatticeTet& t : tets)
            for (int a = 0; a < 4; ++a)
                for (int b = a + 1; b < 4; ++b) addWay(t, a, b);
        std::sort(ways_.begin(), ways_.end(),
                  [](const Way& a, const Way& b) { return std::tie(a.from, a.to) < std::tie(b.from, b.to); });
        ways_.erase(std::unique(ways_.begin(), ways_.end(),
                                [](const Way& a, const Way& b) { return a.from == b.from && a.to == b.to; }),
                    ways_.end());
        for (std::size_t i = 0; i < ways_.size(); ++i)
            if (i == 0 || ways_[i].from != ways_[i - 1].from) unsure_.push_back({ways_[i].from, i, std::nullopt});
        settle();
    }

    bool operator()(Coord node) const
    {
        if (const auto known = sure(node)) return *known;
        const Unsure* u = find(node);
        return u && u->isInside ? *u->isInside : source_.rest(node) < 0;
    }

    /// Is the point where c = 0 on an edge inside?
    bool atCrossing(SimplexKey edge, Coord closed) const { return (*this)(closed) != isOdd(edge, false); }

private:
    struct Way {
        Coord from, to;
        SimplexKey edge;
    };
    struct Unsure {
        Coord node;
        std::size_t firstWay;
        std::optional<bool> isInside;
    };

    std::optional<bool> sure(Coord node) const
    {
        const double phi = source_.rest(node);
        if (std::abs(phi) < source_.offset + kSure * source_.lattice.voxelSize()) return std::nullopt;
        return phi < 0;
    }
    const Unsure* find(Coord node) const
    {
        const auto at =
            std::lower_bound(unsure_.begin(), unsure_.end(), node, [](const Unsure& u, Coord n) { return u.node < n; });
        return at != unsure_.end() && at->node == node ? &*at : nullptr;
    }
    void addWay(const LatticeTet& t, int a, int b)
    {
        const Coord p = t.node[std::size_t(a)], q = t.node[std::size_t(b)];
        const bool isUnsureP = !sure(p), isUnsureQ = !sure(q);
        if (!isUnsureP && !isUnsureQ) return;
        const SimplexKey edge = source_.lattice.edgeKey(t, a, b);
        if (isUnsureP) ways_.push_back({p, q, edge});
        if (isUnsureQ) ways_.push_back({q, p, edge});
    }
    /// Do an odd number of triangles meet an edge, of all or of its part where c < 0?
    bool isOdd(SimplexKey edge, bool all) const
    {
        const auto& piercings = source_.crossings.piercings;
        auto at = std::lower_bound(piercings.begin(), piercings.end(), edge,
                                   [](const Piercing& p, SimplexKey e) { return p.edge < e; });
        bool odd = false;
        for (; at != piercings.end() && at->edge == edge; ++at)
            odd ^= (all || !at->open) && !source_.isInner[at->triangle];
        return odd;
    }
    /// Spreads from nodes that are sure, one edge at a time.
    void settle()
    {
        for (bool changed = true; changed;) {
            changed = false;
            std::vector<std::pair<std::size_t, bool>> found;
            for (std::size_t i = 0; i < unsure_.size(); ++i) {
                if (unsure_[i].isInside) continue;
                for (std::size_t w = unsure_[i].firstWay; w < ways_.size() && ways_[w].from == unsure_[i].node; ++w) {
                    std::optional<bool> there = sure(ways_[w].to);
                    if (const Unsure* u = there ? nullptr : find(ways_[w].to)) there = u->isInside;
                    if (!there) continue;
                    found.push_back({i, *there != isOdd(ways_[w].edge, true)});
                    break;
                }
            }
            for (const auto& [i, inside] : found) unsure_[i].isInside = inside, changed = true;
        }
    }

    const TornSource& source_;
    std::vector<Way> ways_;       // from nodes that are not sure; sorted
    std::vector<Unsure> unsure_;  // by node
};

/// A corner of a torn face: where the skin crosses c = 0, or an edge of the lattice does.
struct TornCorner {
    bool isLattice = false;
    std::uint64_t name = 0;  // key of the edge, or number of the crossing
    friend auto operator<=>(const TornCorner&, const TornCorner&) = default;
};
struct LatticePoint {
    SimplexKey edge = 0;
    Vec3 X = Vec3::Zero();
    Coord closed;
};

/// What one chunk of tets makes.
struct TornPart {
    std::vector<std::array<TornCorner, 3>> faces;
    std::vector<LatticePoint> points;
    std::int64_t defects = 0;
};

/// The part of c = 0 in one tet.
class TetFace {
public:
    TetFace(const TornSource& source, const InnerNodes& inner, const LatticeTet& tet,
            std::span<const RimSegment> segments, TornPart& part)
        : source_(source), inner_(inner), tet_(tet), segments_(segments), part_(part)
    {
        findCorners();
    }

    void add()
    {
        if (segments_.empty()) {
            if (isInside_[0]) addWhole();
            return;
        }
        const NamedPolygon<TornCorner> named = polygon();
        const PlanarTriangles divided = triangulate(named.polygon);
        part_.defects += !divided.isSound;
        for (std::size_t i = 0; i < divided.triangles.size(); ++i)
            if (divided.label[i]) addFace(named.names(divided.triangles[i]));
    }

private:
    void findCorners()
    {
        std::array<int, 4> order{};  // nodes in a crack first
        int open = 0, at = 0;
        for (const bool wanted : {true, false})
            for (int a = 0; a < 4; ++a)
                if (source_.lattice.isOpen(tet_.node[std::size_t(a)]) == wanted)
                    order[std::size_t(at++)] = a, open += wanted;
        if (open == 1)
            for (const int k : {1, 2, 3}) addCorner(order[0], order[std::size_t(k)]);
        else if (open == 3)
            for (const int k : {0, 1, 2}) addCorner(order[std::size_t(k)], order[3]);
        else
            for (const auto& [i, k] : {std::pair{0, 2}, {0, 3}, {1, 3}, {1, 2}})
                addCorner(order[std::size_t(i)], order[std::size_t(k)]);
        orient(order, open);
    }
    void addCorner(int open, int closed)
    {
        const Coord n = tet_.node[std::size_t(closed)], o = tet_.node[std::size_t(open)];
        const double a = source_.lattice.c(n), b = source_.lattice.c(o);
        const Vec3 X = source_.lattice.position(n), Y = source_.lattice.position(o);
        const SimplexKey key = source_.lattice.edgeKey(tet_, std::min(open, closed), std::max(open, closed));
        corners_.push_back({key, X + a / (a - b) * (Y - X), n});
        ends_.push_back({open, closed});
        isInside_.push_back(inner_.atCrossing(key, n));
    }
    /// Turns the corners so that the face looks into the crack.
    void orient(const std::array<int, 4>& order, int open)
    {
        normal_ = (corners_[1].X - corners_[0].X).cross(corners_[2].X - corners_[0].X);
        if (corners_.size() == 4) normal_ = (corners_[2].X - corners_[0].X).cross(corners_[3].X - corners_[1].X);
        const Vec3 toOpen = source_.lattice.position(tet_.node[std::size_t(order[0])]) -
                            source_.lattice.position(tet_.node[std::size_t(order[std::size_t(open)])]);
        if (normal_.dot(toOpen) >= 0) return;
        normal_ = -normal_;
        std::reverse(corners_.begin(), corners_.end());
        std::reverse(ends_.begin(), ends_.end());
        std::reverse(isInside_.begin(), isInside_.end());
    }

    TornCorner nameOf(const LatticePoint& p)
    {
        part_.points.push_back(p);
        return {true, p.edge};
    }
    void addWhole()
    {
        for (std::size_t k = 2; k < corners_.size(); ++k)
            addFace({nameOf(corners_[0]), nameOf(corners_[k - 1]), nameOf(corners_[k])});
    }
    void addFace(const std::array<TornCorner, 3>& face)
    {
        if (face[0] != face[1] && face[1] != face[2] && face[2] != face[0]) part_.faces.push_back(face);
    }

    /// The corners, on each side between them the crossings of the skin with it, and the lines that the skin cuts.
    NamedPolygon<TornCorner> polygon()
    {
        NamedPolygon<TornCorner> named(normal_);
        const auto numberOf = [&](std::uint32_t crossing) {
            return named.number({false, crossing}, source_.crossings.points[crossing].X);
        };
        std::vector<std::uint32_t> round;
        std::vector<std::uint8_t> labels;
        for (std::size_t k = 0; k < corners_.size(); ++k) {
            round.push_back(named.number(nameOf(corners_[k]), corners_[k].X));
            std::uint8_t label = isInside_[k];
            labels.push_back(label);
            for (std::uint32_t crossing : crossingsBetween(k, (k + 1) % corners_.size())) {
                round.push_back(numberOf(crossing));
                labels.push_back(label ^= 1);
            }
        }
        named.polygon.goRound(round, labels);
        for (const RimSegment& s : segments_)
            named.polygon.lines.push_back({numberOf(s.crossing[0]), numberOf(s.crossing[1])});
        return named;
    }
    /// Crossings in the face of the tet that holds two corners, from the one to the other.
    std::vector<std::uint32_t> crossingsBetween(std::size_t k, std::size_t next) const
    {
        std::vector<int> nodes{ends_[k][0], ends_[k][1], ends_[next][0], ends_[next][1]};
        sortUnique(nodes);
        const SimplexKey face = source_.lattice.faceKey(tet_, nodes[0], nodes[1], nodes[2]);
        const bool turned = corners_[k].edge > corners_[next].edge;
        const Vec3 along = (turned ? -1. : 1.) * (corners_[next].X - corners_[k].X);
        std::vector<std::pair<double, std::uint32_t>> found;
        for (const RimSegment& s : segments_)
            for (std::uint32_t c : s.crossing)
                if (const Crossing& p = source_.crossings.points[c]; !p.onEdge && p.lattice == face)
                    found.push_back({along.dot(p.X), c});
        return inOrder(std::move(found), turned);
    }

    const TornSource& source_;
    const InnerNodes& inner_;
    const LatticeTet& tet_;
    std::span<const RimSegment> segments_;
    TornPart& part_;
    std::vector<LatticePoint> corners_;
    std::vector<std::array<int, 2>> ends_;  // of each corner: the nodes of its edge, in a crack and not
    std::vector<std::uint8_t> isInside_;
    Vec3 normal_ = Vec3::Zero();
};

/// Segments that trim, by tet.
std::vector<RimSegment> trimmingSegments(const TornSource& source)
{
    std::vector<RimSegment> segments;
    for (const RimSegment& s : source.crossings.segments)
        if (!source.isInner[s.triangle]) segments.push_back(s);
    std::sort(segments.begin(), segments.end(), [](const RimSegment& a, const RimSegment& b) {
        return std::tie(a.tet, a.triangle) < std::tie(b.tet, b.triangle);
    });
    return segments;
}

std::vector<LatticeTet> mixedTets(const CrackLattice& lattice)
{
    std::vector<LatticeTet> tets;
    for (Coord voxel : lattice.mixedVoxels())
        for (int k = 0; k < 6; ++k)
            if (const LatticeTet t = CrackLattice::tet(voxel, k); lattice.isMixed(t)) tets.push_back(t);
    return tets;
}

/// Numbers the points of the lattice and writes the faces with numbers.
void append(std::vector<TornPart>& parts, const TornSource& source, SkinCut& cut)
{
    std::vector<LatticePoint> points;
    for (const TornPart& p : parts) points.insert(points.end(), p.points.begin(), p.points.end());
    const auto byEdge = [](const LatticePoint& a, const LatticePoint& b) { return a.edge < b.edge; };
    std::sort(points.begin(), points.end(), byEdge);
    points.erase(std::unique(points.begin(), points.end(),
                             [](const LatticePoint& a, const LatticePoint& b) { return a.edge == b.edge; }),
                 points.end());
    const std::size_t first = cut.points.size();
    std::vector<std::uint32_t> number(points.size(), ~0u);
    const auto numberOf = [&](const TornCorner& corner) {
        if (!corner.isLattice) return source.firstPoint + std::uint32_t(corner.name);
        const auto at = std::lower_bound(points.begin(), points.end(), LatticePoint{corner.name, {}, {}}, byEdge);
        std::uint32_t& n = number[std::size_t(at - points.begin())];
        if (n == ~0u) {
            n = source.firstPoint + std::uint32_t(cut.points.size());
            cut.points.push_back({at->X, at->closed, SkinCut::kNoSkin, false});
        }
        return n;
    };
    cut.points.reserve(first + points.size());
    for (const TornPart& p : parts) {
        for (const auto& f : p.faces) {
            const std::uint32_t a = numberOf(f[0]), b = numberOf(f[1]), c = numberOf(f[2]);
            cut.torn.push_back({a, b, c});
        }
        cut.defects += p.defects;
    }
}

}  // namespace

void addTornFaces(const TornSource& source, SkinCut& cut)
{
    constexpr std::size_t kTets = 256;
    const std::vector<LatticeTet> tets = mixedTets(source.lattice);
    const std::vector<RimSegment> segments = trimmingSegments(source);
    const InnerNodes inner(source, tets);
    std::vector<TornPart> parts((tets.size() + kTets - 1) / kTets);
    parallelChunks(tets.size(), kTets, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const SimplexKey key = source.lattice.key(tets[i]);
            const auto own = std::ranges::equal_range(segments, key, {}, &RimSegment::tet);
            TetFace(source, inner, tets[i], own, parts[begin / kTets]).add();
        }
    });
    append(parts, source, cut);
}

}  // namespace vdbfrac::skin
