#include "triangles.h"

#include <vdbfrac/base/parallel.h>

#include <Eigen/Geometry>

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace vdbfrac::grid {

namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
constexpr std::size_t kInLeaf = 4;  // triangles
/// Of a triangle and of a segment: what rounding may leave between two triangles that share an edge.
constexpr double kTouch = 1e-9;
/// Sine of the widest angle below which a triangle has no normal that can be relied on.
constexpr double kFlat = 1e-10;

/// The bits of a number of 21 bits, two zeros between each.
std::uint64_t spread(std::uint64_t v)
{
    v = (v | v << 32) & 0x1f00000000ffffu;
    v = (v | v << 16) & 0x1f0000ff0000ffu;
    v = (v | v << 8) & 0x100f00f00f00f00fu;
    v = (v | v << 4) & 0x10c30c30c30c30c3u;
    return (v | v << 2) & 0x1249249249249249u;
}

/// Triangles along a Morton curve through their middles.
std::vector<std::uint32_t> mortonOrder(const Triangles& triangles)
{
    struct Key {
        std::uint64_t code;
        std::uint32_t triangle;
        bool operator<(const Key& o) const { return code != o.code ? code < o.code : triangle < o.triangle; }
    };
    Eigen::AlignedBox3d box;
    for (const Vec3& X : triangles.points) box.extend(X);
    const double scale = double((1 << 21) - 1) / std::max(box.sizes().maxCoeff(), std::numeric_limits<double>::min());
    std::vector<Key> keys(triangles.corners.size());
    parallelChunks(keys.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n) {
            const auto [a, b, c] = triangles.cornersOf(n);
            const Vec3 at = ((a + b + c) / 3 - box.min()) * scale;
            keys[n] = {
                spread(std::uint64_t(at.x())) | spread(std::uint64_t(at.y())) << 1 | spread(std::uint64_t(at.z())) << 2,
                std::uint32_t(n)};
        }
    });
    tbb::parallel_sort(keys.begin(), keys.end());
    std::vector<std::uint32_t> order(keys.size());
    for (std::size_t i = 0; i < keys.size(); ++i) order[i] = keys[i].triangle;
    return order;
}

/// Moller, Trumbore 1997, with tolerance.
bool crosses(const Triangles& triangles, std::uint32_t n, const Vec3& from, const Vec3& step,
             TriangleTree::Crossing& found)
{
    const auto [a, b, c] = triangles.cornersOf(n);
    const Vec3 e1 = b - a, e2 = c - a, s = from - a;
    const Vec3 h = step.cross(e2);
    const double det = e1.dot(h);
    if (det * det <= 1e-28 * e1.squaredNorm() * h.squaredNorm()) return false;  // along its plane: its neighbours tell
    const double u = s.dot(h) / det;
    const Vec3 w = s.cross(e1);
    const double v = step.dot(w) / det, t = e2.dot(w) / det;
    found = {t, n, det < 0};
    return u >= -kTouch && v >= -kTouch && u + v <= 1 + kTouch && t >= -kTouch && t <= 1 + kTouch;
}

}  // namespace

ClosestPoint closestPoint(const Triangles& triangles, std::size_t triangle, const Vec3& X)
{
    return vdbfrac::closestPoint(triangles.cornersOf(triangle), X);
}

TriangleTree::TriangleTree(const Triangles& triangles) : triangles_(triangles), order_(mortonOrder(triangles))
{
    firstLeaf_ = std::bit_ceil(std::max<std::size_t>(1, (order_.size() + kInLeaf - 1) / kInLeaf));
    constexpr float kFar = std::numeric_limits<float>::infinity();
    nodes_.assign(2 * firstLeaf_, {{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}});
    parallelChunks(firstLeaf_, kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin * kInLeaf; i < std::min(end * kInLeaf, order_.size()); ++i) {
            Box& box = nodes_[firstLeaf_ + i / kInLeaf];
            for (const Vec3& X : triangles_.cornersOf(order_[i]))
                for (std::size_t k = 0; k < 3; ++k) {  // rounded outward
                    box.lower[k] = std::min(box.lower[k], std::nextafter(float(X[Eigen::Index(k)]), -kFar));
                    box.upper[k] = std::max(box.upper[k], std::nextafter(float(X[Eigen::Index(k)]), kFar));
                }
        }
    });
    for (std::size_t n = firstLeaf_ - 1; n >= 1; --n)
        for (std::size_t k = 0; k < 3; ++k) {
            nodes_[n].lower[k] = std::min(nodes_[2 * n].lower[k], nodes_[2 * n + 1].lower[k]);
            nodes_[n].upper[k] = std::max(nodes_[2 * n].upper[k], nodes_[2 * n + 1].upper[k]);
        }
}

/// Calls visit(triangle) for those whose boxes overlap that of the segment, until it returns true.
template <class Visit>
void TriangleTree::visitNear(const Vec3& from, const Vec3& to, const Visit& visit) const
{
    const Vec3 lower = from.cwiseMin(to), upper = from.cwiseMax(to);
    std::array<std::size_t, 64> stack{1};
    for (std::size_t size = 1; size > 0;) {
        const std::size_t n = stack[--size];
        const Box& box = nodes_[n];
        bool apart = false;
        for (std::size_t k = 0; k < 3; ++k)
            apart = apart || box.lower[k] > upper[Eigen::Index(k)] || box.upper[k] < lower[Eigen::Index(k)];
        if (apart) continue;
        if (n < firstLeaf_) {
            stack[size++] = 2 * n + 1;
            stack[size++] = 2 * n;
            continue;
        }
        const std::size_t begin = (n - firstLeaf_) * kInLeaf;
        for (std::size_t i = begin; i < std::min(begin + kInLeaf, order_.size()); ++i)
            if (visit(order_[i])) return;
    }
}

bool TriangleTree::isCrossed(const Vec3& from, const Vec3& to) const
{
    bool found = false;
    const Vec3 step = to - from;
    Crossing unused;
    visitNear(from, to, [&](std::uint32_t n) { return found = crosses(triangles_, n, from, step, unused); });
    return found;
}

std::vector<TriangleTree::Crossing> TriangleTree::crossings(const Vec3& from, const Vec3& to) const
{
    std::vector<Crossing> found;
    const Vec3 step = to - from;
    visitNear(from, to, [&](std::uint32_t n) {
        if (Crossing c; crosses(triangles_, n, from, step, c)) found.push_back(c);
        return false;
    });
    std::sort(found.begin(), found.end(),
              [](const Crossing& a, const Crossing& b) { return a.t != b.t ? a.t < b.t : a.triangle < b.triangle; });
    return found;
}

TriangleSides::TriangleSides(const Triangles& triangles) : triangles_(triangles)
{
    weldPoints();
    measureFaces();
    const std::vector<HalfEdge> edges = halfEdges();
    join(edges);
    findShells(edges);
    turnOutward();
    sumCorners();
}

/// Points with equal coordinates are one: a table with open addresses, half full at most.
void TriangleSides::weldPoints()
{
    const std::vector<Vec3>& X = triangles_.points;
    const int bits = std::bit_width(2 * X.size() + 1);
    const std::size_t mask = (std::size_t{1} << bits) - 1;
    std::vector<std::uint32_t> table(mask + 1, kNone);
    point_.resize(X.size());
    for (std::size_t i = 0; i < X.size(); ++i) {
        std::uint64_t hash = 0;
        for (int a = 0; a < 3; ++a) hash = (hash ^ std::bit_cast<std::uint64_t>(X[i][a] + 0.)) * 0x9e3779b97f4a7c15u;
        std::size_t at = std::size_t(hash >> (64 - bits));
        while (table[at] != kNone && X[table[at]] != X[i]) at = (at + 1) & mask;
        if (table[at] == kNone) table[at] = std::uint32_t(i);
        point_[i] = table[at];
    }
}

void TriangleSides::measureFaces()
{
    const std::size_t count = triangles_.corners.size();
    normal_.resize(count);
    flat_.resize(count);
    parallelChunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n) {
            const auto [a, b, c] = triangles_.cornersOf(n);
            const Vec3 twice = (b - a).cross(c - a);
            const double widest = std::max({(b - a).squaredNorm(), (c - a).squaredNorm(), (c - b).squaredNorm()});
            flat_[n] = !(twice.norm() > kFlat * widest);
            normal_[n] = twice.normalized().cast<float>();
        }
    });
}

/// Sorted, so that those of one edge follow each other. Edges of no length are left out.
std::vector<TriangleSides::HalfEdge> TriangleSides::halfEdges() const
{
    std::vector<HalfEdge> edges(3 * triangles_.corners.size());
    parallelChunks(edges.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t h = begin; h < end; ++h) {
            const std::uint64_t a = startOf(std::uint32_t(h)), b = startOf(std::uint32_t(h - h % 3 + (h + 1) % 3));
            edges[h] = {std::min(a, b) << 32 | std::max(a, b), std::uint32_t(h)};
        }
    });
    std::erase_if(edges, [](const HalfEdge& e) { return e.key >> 32 == (e.key & 0xffffffffu); });
    tbb::parallel_sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
        return a.key != b.key ? a.key < b.key : a.number < b.number;
    });
    return edges;
}

void TriangleSides::join(const std::vector<HalfEdge>& edges)
{
    twin_.assign(3 * triangles_.corners.size(), kNone);
    for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
        while (end < edges.size() && edges[end].key == edges[begin].key) ++end;
        if (end - begin != 2) continue;
        twin_[edges[begin].number] = edges[begin + 1].number;
        twin_[edges[begin + 1].number] = edges[begin].number;
    }
}

bool TriangleSides::runsAlike(std::uint32_t halfEdge, std::uint32_t other) const
{
    return startOf(halfEdge) == startOf(other);
}

void TriangleSides::orientFrom(std::uint32_t seed, std::uint32_t shell)
{
    shell_[seed] = shell;
    std::vector<std::uint32_t> open{seed};
    while (!open.empty()) {
        const std::uint32_t n = open.back();
        open.pop_back();
        for (std::uint32_t h = 3 * n; h < 3 * n + 3; ++h) {
            if (twin_[h] == kNone) continue;
            const std::uint32_t other = twin_[h] / 3;
            const bool turned = (turned_[n] != 0) != runsAlike(h, twin_[h]);
            if (shell_[other] == kNone) {
                shell_[other] = shell;
                turned_[other] = turned;
                open.push_back(other);
            } else if ((turned_[other] != 0) != turned)
                sound_[shell] = 0;  // it has one side only
        }
    }
}

void TriangleSides::findShells(const std::vector<HalfEdge>& edges)
{
    const std::size_t count = triangles_.corners.size();
    shell_.assign(count, kNone);
    turned_.assign(count, 0);
    for (std::uint32_t n = 0; n < count; ++n) {
        if (shell_[n] != kNone) continue;
        sound_.push_back(1);
        orientFrom(n, std::uint32_t(sound_.size() - 1));
    }
    for (const HalfEdge& e : edges)  // where more than two meet, nothing says which of them go on in each other
        if (twin_[e.number] == kNone) sound_[shell_[e.number / 3]] = 0;
}

void TriangleSides::turnOutward()
{
    const Vec3 origin = triangles_.points.empty() ? Vec3::Zero() : triangles_.points[0];
    std::vector<double> volume(sound_.size());
    for (std::size_t n = 0; n < turned_.size(); ++n) {
        const auto [a, b, c] = triangles_.cornersOf(n);
        const double part = (a - origin).dot((b - origin).cross(c - origin));
        volume[shell_[n]] += turned_[n] ? -part : part;
    }
    for (std::size_t s = 0; s < sound_.size(); ++s) sound_[s] = sound_[s] && volume[s] != 0;
    for (std::size_t n = 0; n < turned_.size(); ++n) {
        if (volume[shell_[n]] < 0) turned_[n] = !turned_[n];
        if (turned_[n]) normal_[n] = -normal_[n];
    }
}

void TriangleSides::sumCorners()
{
    const std::size_t count = triangles_.corners.size();
    std::vector<std::array<float, 3>> angles(count);
    parallelChunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n) {
            const auto X = triangles_.cornersOf(n);
            for (std::size_t k = 0; k < 3; ++k) {
                const Vec3 u = X[(k + 1) % 3] - X[k], v = X[(k + 2) % 3] - X[k];
                angles[n][k] = float(std::atan2(u.cross(v).norm(), u.dot(v)));
            }
        }
    });
    corner_.assign(triangles_.points.size(), Eigen::Vector3f::Zero());
    mixed_.assign(triangles_.points.size(), 0);
    std::vector<std::uint32_t> shell(triangles_.points.size(), kNone);
    for (std::size_t n = 0; n < count; ++n)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t p = point_[triangles_.corners[n][k]];
            corner_[p] += angles[n][k] * normal_[n];
            if (shell[p] == kNone) shell[p] = shell_[n];
            if (flat_[n] || shell[p] != shell_[n]) mixed_[p] = 1;
        }
}

TriangleSides::Side TriangleSides::sideOf(const Vec3& X, std::size_t triangle) const
{
    if (!sound_[shell_[triangle]] || flat_[triangle]) return Side::unknown;
    const ClosestPoint closest = closestPoint(triangles_, triangle, X);
    Vec3 normal = normal_[triangle].cast<double>();
    if (closest.on == ClosestPoint::On::edge) {
        const std::uint32_t other = twin_[3 * triangle + std::size_t(closest.number)] / 3;
        if (flat_[other]) return Side::unknown;
        normal += normal_[other].cast<double>();
    } else if (closest.on == ClosestPoint::On::corner) {
        const std::uint32_t p = point_[triangles_.corners[triangle][std::size_t(closest.number)]];
        if (mixed_[p]) return Side::unknown;
        normal = corner_[p].cast<double>();
    }
    const Vec3 away = X - closest.at;
    const double d = away.dot(normal);
    // The normals are floats.
    if (std::abs(d) <= 1e-6 * away.norm() * normal.norm()) return Side::unknown;
    return d > 0 ? Side::outside : Side::inside;
}

}  // namespace vdbfrac::grid
