#include "skin_corners.h"

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/base/triangle.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <tuple>

namespace vdbfrac::skin {

using tetmesh::RenderMesh;

namespace {

using Corner = RenderMesh::Corner;

/// One of what corners have.
struct Attribute {
    std::vector<Vec3> RenderMesh::*values;
    std::uint32_t Corner::*number;
};
constexpr Attribute kUv{&RenderMesh::uvs, &Corner::uv}, kNormal{&RenderMesh::normals, &Corner::normal};

/// Do the triangles a and b have different values at the ends of the edge that they share?
bool jumps(const GivenSkin& skin, std::uint32_t edge, std::uint32_t a, std::uint32_t b, const Attribute& of)
{
    const auto at = [&](std::uint32_t triangle, std::uint32_t end) {
        const auto& t = skin.topology.triangles[triangle];
        return skin.corner(triangle, std::size_t(std::ranges::find(t, end) - t.begin())).*of.number;
    };
    const std::vector<Vec3>& values = skin.mesh.*of.values;
    return std::ranges::any_of(skin.topology.edges[edge], [&](std::uint32_t end) {
        const std::uint32_t p = at(a, end), q = at(b, end);
        if (p == RenderMesh::kNone || q == RenderMesh::kNone) return p != q;
        return p != q && values[p] != values[q];
    });
}

/// From triangle to triangle, the nearest first, as long as they are as near to X as what was found.
/// `mayPass(edge, from, to)`
template <class MayPass>
SkinPlace nearest(const SkinTopology& skin, std::uint32_t triangle, const Vec3& X, const MayPass& mayPass)
{
    struct Reached : SkinPlace {
        double distance;  // squared
        bool operator>(const Reached& o) const
        {
            return std::tie(distance, triangle) > std::tie(o.distance, o.triangle);
        }
    };
    std::vector<Reached> next;  // a heap
    std::vector<std::uint32_t> reached;
    const auto reach = [&](std::uint32_t t) {
        const Vec3 at = closestPoint(skin.corners(t), X).at;
        next.push_back({{t, at}, (at - X).squaredNorm()});
        std::ranges::push_heap(next, std::greater<>());
        reached.push_back(t);
    };
    reach(triangle);
    Reached best = next.front();
    while (!next.empty() && next.front().distance <= best.distance) {
        const Reached now = next.front();
        if (now.distance < best.distance) best = now;
        std::ranges::pop_heap(next, std::greater<>());
        next.pop_back();
        for (const std::uint32_t e : skin.edgeOf[now.triangle])
            for (const std::uint32_t beside : skin.trianglesOf[e])
                if (mayPass(e, now.triangle, beside) && std::ranges::find(reached, beside) == reached.end())
                    reach(beside);
    }
    return best;
}

std::uint32_t addTo(std::vector<Vec3>& values, const std::optional<Vec3>& value)
{
    if (!value) return RenderMesh::kNone;
    values.push_back(*value);
    return std::uint32_t(values.size() - 1);
}

}  // namespace

std::vector<std::uint8_t> seamsOf(const GivenSkin& skin)
{
    const SkinTopology& topology = skin.topology;
    std::vector<std::uint8_t> isSeam(topology.points.size(), 0);
    parallelChunks(topology.edges.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t e = begin; e < end; ++e) {
            const auto beside = topology.trianglesOf[e];
            const auto isOther = [&](std::uint32_t t) {
                return jumps(skin, std::uint32_t(e), beside[0], t, kUv) ||
                       jumps(skin, std::uint32_t(e), beside[0], t, kNormal);
            };
            if (std::ranges::any_of(beside.subspan(1), isOther))
                for (const std::uint32_t p : topology.edges[e])
                    std::atomic_ref(isSeam[p]).store(1, std::memory_order_relaxed);
        }
    });
    return isSeam;
}

std::vector<std::array<Corner, 3>> SkinCorners::of(std::span<const SkinCut::Part> parts)
{
    const auto given = std::uint32_t(skin_.mesh.points.size());
    const Groups slotsAt = groupItems(points_.size(), [&](const auto& add) {
        for (std::uint32_t i = 0; i < parts.size(); ++i)
            for (std::uint32_t k = 0; k < 3; ++k)
                if (const std::uint32_t p = parts[i].corner[k]; p >= given) add(p - given, 3 * i + k);
    });
    std::vector<Chart> chart(parts.size());
    parallelChunks(parts.size(), 32, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) chart[i] = chartOf(parts[i]);
    });
    const auto isOwn = [&](std::uint32_t i) { return chart[i] == Chart{parts[i].triangle, parts[i].triangle}; };
    std::vector<std::uint32_t> firstAlike(3 * parts.size());
    std::vector<Made> made(firstAlike.size());
    parallelChunks(points_.size(), 32, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p) {
            const auto slots = slotsAt[p];
            if (slots.empty()) continue;
            const Vec3& X = points_[p].X;
            const std::optional<SkinPlace> ofAll = awayFromSeams(parts[slots[0] / 3].triangle, X);
            std::uint32_t away = RenderMesh::kNone, near = away;  // the first slot of those that are alike
            for (const std::uint32_t s : slots) {
                const bool isAway = ofAll && isOwn(s / 3);
                std::uint32_t& alike = isAway ? away : near;
                if (alike == RenderMesh::kNone || (!isAway && chart[s / 3] != chart[alike / 3])) alike = s;
                firstAlike[s] = alike;
                if (alike == s) made[s] = madeAt(chart[s / 3], X, isAway ? ofAll : std::nullopt);
            }
        }
    });
    std::vector<std::array<Corner, 3>> corners(parts.size());
    for (std::uint32_t i = 0; i < parts.size(); ++i)
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t point = parts[i].corner[k], slot = 3 * i + k, alike = firstAlike[slot];
            if (point < given)
                corners[i][k] = givenCorner(parts[i], point, chart[i]);
            else if (alike == slot)
                corners[i][k] = {point, addTo(drawn_.uvs, made[slot].uv), addTo(drawn_.normals, made[slot].normal)};
            else
                corners[i][k] = corners[alike / 3][alike % 3];
        }
    return corners;
}

const Vec3& SkinCorners::place(std::uint32_t point) const
{
    const std::size_t given = skin_.mesh.points.size();
    return point < given ? skin_.mesh.points[point] : points_[point - given].X;
}

/// The triangle that the part is of, or where its middle lies if a seam is between.
SkinCorners::Chart SkinCorners::chartOf(const SkinCut::Part& part) const
{
    constexpr double kFarther = 1e-9;  // of the part: rounding
    Chart chart{part.triangle, part.triangle};
    const Vec3 &a = place(part.corner[0]), &b = place(part.corner[1]), &c = place(part.corner[2]);
    const Vec3 middle = (a + b + c) / 3;
    if (awayFromSeams(part.triangle, middle)) return chart;
    const auto anyway = [](std::uint32_t, std::uint32_t, std::uint32_t) { return true; };
    const SkinPlace there = nearest(skin_.topology, part.triangle, middle, anyway);
    if (there.triangle == part.triangle) return chart;
    const double far = (there.at - middle).norm() + kFarther * ((b - a).norm() + (c - a).norm());
    const auto isBeyond = [&](const Attribute& of) {
        const auto mayPass = [&](std::uint32_t e, std::uint32_t s, std::uint32_t t) {
            return !jumps(skin_, e, s, t, of);
        };
        return (nearest(skin_.topology, part.triangle, middle, mayPass).at - middle).norm() > far;
    };
    if (isBeyond(kUv)) chart.uv = there.triangle;
    if (isBeyond(kNormal)) chart.normal = there.triangle;
    return chart;
}

/// A corner of the surface as it was given has what the part's triangle has there, unless the part has gone elsewhere.
Corner SkinCorners::givenCorner(const SkinCut::Part& part, std::uint32_t point, const Chart& chart)
{
    Corner corner;
    for (std::size_t own = 0; own < 3; ++own)
        if (const Corner& c = skin_.corner(part.triangle, own); c.point == point) corner = c;
    if (chart == Chart{part.triangle, part.triangle}) return corner;
    const Made made = madeAt(chart, place(point), {});
    if (chart.uv != part.triangle) corner.uv = addTo(drawn_.uvs, made.uv);
    if (chart.normal != part.triangle) corner.normal = addTo(drawn_.normals, made.normal);
    return corner;
}

/// Where a point lies that started at a triangle, or on its rim; nothing where the way there comes near a seam.
std::optional<SkinPlace> SkinCorners::awayFromSeams(std::uint32_t triangle, const Vec3& X) const
{
    bool isClear = true;
    const SkinPlace place = nearest(skin_.topology, triangle, X, [&](std::uint32_t, std::uint32_t from, std::uint32_t) {
        const auto isSeam = [&](std::uint32_t p) { return isSeam_[p] != 0; };
        isClear = isClear && std::ranges::none_of(skin_.topology.triangles[from], isSeam);
        return isClear;
    });
    return isClear ? std::optional(place) : std::nullopt;
}

SkinCorners::Made SkinCorners::madeAt(const Chart& chart, const Vec3& X, const std::optional<SkinPlace>& place) const
{
    const auto value = [&](const Attribute& of, std::uint32_t triangle) -> std::optional<Vec3> {
        for (std::size_t k = 0; k < 3; ++k)
            if (skin_.corner(triangle, k).*of.number == RenderMesh::kNone) return {};
        const auto mayPass = [&](std::uint32_t e, std::uint32_t a, std::uint32_t b) {
            return !jumps(skin_, e, a, b, of);
        };
        const auto [on, at] = place ? *place : nearest(skin_.topology, triangle, X, mayPass);
        const Vec3 shares = sharesOf(skin_.topology.corners(on), at);
        Vec3 sum = Vec3::Zero();
        for (std::size_t k = 0; k < 3; ++k)
            sum += shares[int(k)] * (skin_.mesh.*of.values)[skin_.corner(on, k).*of.number];
        return sum;
    };
    Made made{value(kUv, chart.uv), value(kNormal, chart.normal)};
    if (made.normal) made.normal->normalize();
    return made;
}

}  // namespace vdbfrac::skin
