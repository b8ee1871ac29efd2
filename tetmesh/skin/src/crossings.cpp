#include "crossings.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <tuple>

namespace vdbfrac::skin {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

Kernel::Point_3 exact(const Vec3& p) { return {p.x(), p.y(), p.z()}; }

/// Does d lie on the positive side of the plane a, b, c?
bool isAbove(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d)
{
    return CGAL::orientation(exact(a), exact(b), exact(c), exact(d)) == CGAL::POSITIVE;
}

constexpr std::size_t kEdgeEnds[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
/// Of the face opposite to each node: its nodes, and its edges in the direction 0 1, 1 2, 0 2.
constexpr std::size_t kFaceNodes[4][3] = {{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}};
constexpr std::size_t kFaceEdges[4][3] = {{3, 5, 4}, {1, 5, 2}, {0, 4, 2}, {0, 3, 1}};

struct Sample {
    Vec3 X;
    double c = 0;
};

/// c = 0 between two points, reckoned from the side with material.
Vec3 zeroBetween(Sample a, Sample b)
{
    if (a.c > 0) std::swap(a, b);
    return a.X + a.c / (a.c - b.c) * (b.X - a.X);
}

double share(double a, double b)
{
    const double t = a / (a - b);
    return t >= 0 && t <= 1 ? t : 0.5;  // rounding, where the predicates saw more than it
}

class Tet {
public:
    Tet(const CrackLattice& lattice, const LatticeTet& tet) : tet_(tet)
    {
        for (std::size_t a = 0; a < 4; ++a) X[a] = lattice.position(tet.node[a]), c[a] = lattice.c(tet.node[a]);
        for (std::size_t f = 0; f < 4; ++f) inner_[f] = isAboveFace(f, X[f]);
    }
    bool isAboveFace(std::size_t f, const Vec3& p) const
    {
        const auto& n = kFaceNodes[f];
        return isAbove(X[n[0]], X[n[1]], X[n[2]], p);
    }
    bool contains(const std::array<bool, 4>& above) const { return above == inner_; }
    /// c at a point, linear.
    double at(const Vec3& p) const
    {
        Mat3 edges;
        for (std::size_t a = 0; a < 3; ++a) edges.col(int(a)) = X[a + 1] - X[0];
        const Vec3 w = edges.inverse() * (p - X[0]);
        return c[0] + w.x() * (c[1] - c[0]) + w.y() * (c[2] - c[0]) + w.z() * (c[3] - c[0]);
    }
    /// Where the segment a b goes through a face.
    Sample throughFace(std::size_t f, const Vec3& a, const Vec3& b) const
    {
        const auto& n = kFaceNodes[f];
        const Vec3 normal = (X[n[1]] - X[n[0]]).cross(X[n[2]] - X[n[0]]);
        Sample s{a + share(normal.dot(a - X[n[0]]), normal.dot(b - X[n[0]])) * (b - a), 0};
        double sum = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 &p = X[n[(k + 1) % 3]], &q = X[n[(k + 2) % 3]];
            const double w = std::max(0., normal.dot((p - s.X).cross(q - s.X)));
            s.c += w * c[n[k]], sum += w;
        }
        s.c /= sum;
        return s;
    }
    const LatticeTet& nodes() const { return tet_; }

    std::array<Vec3, 4> X;
    std::array<double, 4> c;

private:
    const LatticeTet& tet_;
    std::array<bool, 4> inner_;  // is node f above the face opposite to it?
};

/// One triangle against the tets round it.
class TriangleCrossings {
public:
    TriangleCrossings(const SkinTopology& skin, const CrackLattice& lattice, std::uint32_t triangle, Crossings& found)
        : skin_(skin), lattice_(lattice), triangle_(triangle), found_(found), corner_(skin.corners(triangle))
    {
        for (std::size_t k = 0; k < 3; ++k) inVoxels_[k] = corner_[k] / lattice.voxelSize();
        normal_ = (corner_[1] - corner_[0]).cross(corner_[2] - corner_[0]);
    }

    void visit(const LatticeTet& nodes)
    {
        if (isApart(nodes)) return;
        const Tet tet(lattice_, nodes);
        std::array<bool, 4> above{};
        for (std::size_t a = 0; a < 4; ++a) above[a] = isAbove(corner_[0], corner_[1], corner_[2], tet.X[a]);
        if (above[0] == above[1] && above[1] == above[2] && above[2] == above[3]) return;
        ends_.clear();
        orient(tet);
        pierce(tet, above);
        for (std::size_t k = 0; k < 3; ++k) followEdge(tet, k);
        for (std::size_t f = 0; f < 4; ++f) followFace(tet, f);
        if (ends_.size() == 2) {
            found_.segments.push_back({triangle_, lattice_.key(nodes), {ends_[0], ends_[1]}});
        } else {
            found_.defects += !ends_.empty();
        }
    }

private:
    /// Do all corners lie beyond one face of the tet? Its points are 1 >= p >= q >= r >= 0, in the order in which its
    /// chain of nodes takes the axes.
    bool isApart(const LatticeTet& tet) const
    {
        constexpr double kMargin = 1e-5;  // voxels: more than the nodes were moved
        std::array<int, 3> axis;
        for (std::size_t k = 0; k < 3; ++k) axis[k] = std::countr_zero(unsigned(tet.mask[k + 1] ^ tet.mask[k]));
        std::array<double, 4> most{-1, -1, -1, -1};
        for (const Vec3& corner : inVoxels_) {
            const Vec3 at = corner - tet.node[0].toVec();
            const double p = at[axis[0]], q = at[axis[1]], r = at[axis[2]];
            most = {std::max(most[0], 1 - p), std::max(most[1], p - q), std::max(most[2], q - r), std::max(most[3], r)};
        }
        return std::any_of(most.begin(), most.end(), [](double inside) { return inside < -kMargin; });
    }

    /// Which way each side of the triangle passes each edge of the tet, and where its corners are.
    void orient(const Tet& tet)
    {
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 &a = corner_[k], &b = corner_[(k + 1) % 3];
            for (std::size_t e = 0; e < 6; ++e)
                passes_[k][e] = isAbove(a, b, tet.X[kEdgeEnds[e][0]], tet.X[kEdgeEnds[e][1]]);
            for (std::size_t f = 0; f < 4; ++f) cornerAbove_[k][f] = tet.isAboveFace(f, a);
        }
    }

    void pierce(const Tet& tet, const std::array<bool, 4>& above)
    {
        for (std::size_t e = 0; e < 6; ++e) {
            pierced_[e].reset();
            const std::size_t p = kEdgeEnds[e][0], q = kEdgeEnds[e][1];
            if (above[p] == above[q] || passes_[0][e] != passes_[1][e] || passes_[1][e] != passes_[2][e]) continue;
            const double s = share(normal_.dot(tet.X[p] - corner_[0]), normal_.dot(tet.X[q] - corner_[0]));
            pierced_[e] = {tet.X[p] + s * (tet.X[q] - tet.X[p]), tet.c[p] + s * (tet.c[q] - tet.c[p])};
            found_.piercings.push_back({lattice_.edgeKey(tet.nodes(), int(p), int(q)), triangle_, pierced_[e]->c > 0});
        }
    }

    /// The part of a side of the triangle in the tet: its ends, and the crossing between them.
    void followEdge(const Tet& tet, std::size_t k)
    {
        const std::size_t next = (k + 1) % 3;
        const bool turned = skin_.triangles[triangle_][k] > skin_.triangles[triangle_][next];
        const Vec3 &a = corner_[turned ? next : k], &b = corner_[turned ? k : next];
        std::array<std::optional<Sample>, 2> end;
        int ends = 0;
        const auto add = [&](const Sample& s) {
            if (ends < 2) end[std::size_t(ends)] = s;
            ++ends;
        };
        for (std::size_t f = 0; f < 4; ++f) {
            through_[k][f].reset();
            const auto& e = kFaceEdges[f];
            if (cornerAbove_[k][f] == cornerAbove_[next][f] || passes_[k][e[0]] != passes_[k][e[1]] ||
                passes_[k][e[0]] == passes_[k][e[2]])
                continue;
            through_[k][f] = tet.throughFace(f, a, b);
            add(*through_[k][f]);
        }
        for (const std::size_t v : {k, next})
            if (tet.contains(cornerAbove_[v])) add({corner_[v], tet.at(corner_[v])});
        found_.defects += ends == 1 || ends > 2;
        if (ends != 2 || (end[0]->c > 0) == (end[1]->c > 0)) return;
        const auto& n = tet.nodes().node;
        addEnd({true, skin_.edgeOf[triangle_][k], lattice_.key(tet.nodes()), zeroBetween(*end[0], *end[1]),
                lattice_.anchor(n)});
    }

    /// The part of a face in the triangle: its ends, and the crossing between them.
    void followFace(const Tet& tet, std::size_t f)
    {
        std::array<std::optional<Sample>, 2> end;
        int ends = 0;
        const auto add = [&](const std::optional<Sample>& s) {
            if (!s) return;
            if (ends < 2) end[std::size_t(ends)] = s;
            ++ends;
        };
        for (std::size_t k = 0; k < 3; ++k) add(through_[k][f]);
        for (std::size_t e : kFaceEdges[f]) add(pierced_[e]);
        found_.defects += ends == 1 || ends > 2;
        if (ends != 2 || (end[0]->c > 0) == (end[1]->c > 0)) return;
        const auto& n = kFaceNodes[f];
        const auto& node = tet.nodes().node;
        const std::array<Coord, 3> nodes{node[n[0]], node[n[1]], node[n[2]]};
        addEnd({false, triangle_, lattice_.faceKey(tet.nodes(), int(n[0]), int(n[1]), int(n[2])),
                zeroBetween(*end[0], *end[1]), lattice_.anchor(nodes)});
    }

    void addEnd(const Crossing& crossing)
    {
        ends_.push_back(std::uint32_t(found_.points.size()));
        found_.points.push_back(crossing);
    }

    const SkinTopology& skin_;
    const CrackLattice& lattice_;
    std::uint32_t triangle_;
    Crossings& found_;
    std::array<Vec3, 3> corner_, inVoxels_;
    Vec3 normal_;
    std::array<std::array<bool, 6>, 3> passes_{};
    std::array<std::array<bool, 4>, 3> cornerAbove_{};
    std::array<std::optional<Sample>, 6> pierced_;
    std::array<std::array<std::optional<Sample>, 4>, 3> through_;
    std::vector<std::uint32_t> ends_;
};

auto crossingKey(const Crossing& c) { return std::make_tuple(c.onEdge, c.skin, c.lattice); }

/// Sorts crossings and leaves each once.
void unite(Crossings& all)
{
    std::vector<std::uint32_t> order(all.points.size()), number(all.points.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        const auto p = crossingKey(all.points[a]), q = crossingKey(all.points[b]);
        return p != q ? p < q : a < b;
    });
    std::vector<Crossing> once;
    for (std::uint32_t i : order) {
        if (once.empty() || crossingKey(once.back()) != crossingKey(all.points[i])) once.push_back(all.points[i]);
        number[i] = std::uint32_t(once.size() - 1);
    }
    all.points = std::move(once);
    for (RimSegment& s : all.segments)
        for (std::uint32_t& end : s.crossing) end = number[end];
    std::sort(all.segments.begin(), all.segments.end(), [](const RimSegment& a, const RimSegment& b) {
        return std::tie(a.triangle, a.tet) < std::tie(b.triangle, b.tet);
    });
    const auto piercingKey = [](const Piercing& p) { return std::make_tuple(p.edge, p.triangle); };
    std::sort(all.piercings.begin(), all.piercings.end(),
              [&](const Piercing& a, const Piercing& b) { return piercingKey(a) < piercingKey(b); });
    all.piercings.erase(
        std::unique(all.piercings.begin(), all.piercings.end(),
                    [&](const Piercing& a, const Piercing& b) { return piercingKey(a) == piercingKey(b); }),
        all.piercings.end());
}

/// The tet that X lies in, of its voxel or the next.
LatticeTet tetRound(const CrackLattice& lattice, const Vec3& X)
{
    const Coord voxel = tetmesh::floorOf(X / lattice.voxelSize());
    for (int reach = 0; reach <= 1; ++reach)
        for (int z = -reach; z <= reach; ++z)
            for (int y = -reach; y <= reach; ++y)
                for (int x = -reach; x <= reach; ++x)
                    for (int k = 0; k < 6; ++k) {
                        const LatticeTet nodes = CrackLattice::tet(voxel + Coord{x, y, z}, k);
                        const Tet tet(lattice, nodes);
                        std::array<bool, 4> above{};
                        for (std::size_t f = 0; f < 4; ++f) above[f] = tet.isAboveFace(f, X);
                        if (tet.contains(above)) return nodes;
                    }
    return CrackLattice::tet(voxel, 0);
}

}  // namespace

Crossings findCrossings(const SkinTopology& skin, const CrackLattice& lattice)
{
    constexpr std::size_t kTriangles = 1024;
    const std::size_t count = lattice.mixedVoxels().empty() ? 0 : skin.triangles.size();
    std::vector<Crossings> part((count + kTriangles - 1) / kTriangles);
    parallelChunks(count, kTriangles, [&](std::size_t begin, std::size_t end) {
        Crossings& found = part[begin / kTriangles];
        for (std::uint32_t t = std::uint32_t(begin); t < end; ++t) {
            TriangleCrossings triangle(skin, lattice, t, found);
            bool looked = false;
            forVoxels(skin, t, lattice, [&](Coord voxel) {
                if (!lattice.isMixed(voxel)) return;
                looked = true;
                for (int k = 0; k < 6; ++k)
                    if (const LatticeTet tet = CrackLattice::tet(voxel, k); lattice.isMixed(tet)) triangle.visit(tet);
            });
            if (looked) found.looked.push_back(t);
        }
    });
    Crossings all;
    for (Crossings& p : part) {
        const std::uint32_t first = std::uint32_t(all.points.size());
        for (RimSegment& s : p.segments)
            for (std::uint32_t& end : s.crossing) end += first;
        all.points.insert(all.points.end(), p.points.begin(), p.points.end());
        all.segments.insert(all.segments.end(), p.segments.begin(), p.segments.end());
        all.piercings.insert(all.piercings.end(), p.piercings.begin(), p.piercings.end());
        all.looked.insert(all.looked.end(), p.looked.begin(), p.looked.end());
        all.defects += p.defects;
    }
    unite(all);
    return all;
}

bool isOpen(const CrackLattice& lattice, const Vec3& X)
{
    const Coord voxel = tetmesh::floorOf(X / lattice.voxelSize());
    if (!lattice.isMixed(voxel)) return lattice.isOpen(voxel);
    const LatticeTet nodes = tetRound(lattice, X);
    return Tet(lattice, nodes).at(X) > 0;
}

Coord anchorOf(const CrackLattice& lattice, const Vec3& X)
{
    const Coord voxel = tetmesh::floorOf(X / lattice.voxelSize());
    if (lattice.isMixed(voxel)) return lattice.anchor(tetRound(lattice, X).node);
    std::array<Coord, 8> corners;
    for (int k = 0; k < 8; ++k) corners[std::size_t(k)] = voxel + tetmesh::cornerOffset(k);
    return lattice.anchor(corners);
}

}  // namespace vdbfrac::skin
