#include "skin_corners.h"

#include <vdbfrac/base/disjoint_sets.h>
#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/base/triangle.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <tuple>
#include <utility>

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

Seams seamsOf(const GivenSkin& skin)
{
    const SkinTopology& topology = skin.topology;
    Seams seams{std::vector<std::uint8_t>(topology.points.size(), 0), {}, {}};
    std::array<std::vector<std::uint8_t>, 2> jumpsAt;  // at each edge: texture coordinates, normals
    jumpsAt.fill(std::vector<std::uint8_t>(topology.edges.size(), 0));
    parallelChunks(topology.edges.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t e = begin; e < end; ++e) {
            const auto beside = topology.trianglesOf[e];
            for (const auto& [of, isSeam] : {std::pair(&kUv, &jumpsAt[0]), std::pair(&kNormal, &jumpsAt[1])})
                (*isSeam)[e] = std::ranges::any_of(beside.subspan(1), [&](std::uint32_t t) {
                    return jumps(skin, std::uint32_t(e), beside[0], t, *of);
                });
            if (jumpsAt[0][e] || jumpsAt[1][e])
                for (const std::uint32_t p : topology.edges[e])
                    std::atomic_ref(seams.isAt[p]).store(1, std::memory_order_relaxed);
        }
    });
    const auto islands = [&](const std::vector<std::uint8_t>& isSeam) -> std::vector<std::uint32_t> {
        if (std::ranges::none_of(isSeam, [](std::uint8_t is) { return is; })) return {};
        DisjointSets sets(topology.triangles.size());
        for (std::size_t e = 0; e < isSeam.size(); ++e)
            for (const std::uint32_t t : topology.trianglesOf[e])
                if (!isSeam[e]) sets.join(topology.trianglesOf[e][0], t);
        return std::move(sets).names();
    };
    seams.uvIsland = islands(jumpsAt[0]), seams.normalIsland = islands(jumpsAt[1]);
    return seams;
}

std::vector<std::array<Corner, 3>> SkinCorners::of(std::span<const SkinCut::Part> parts)
{
    const auto given = std::uint32_t(skin_.mesh.points.size());
    const Groups slotsAt = groupItems(points_.size(), [&](const auto& add) {
        for (std::uint32_t i = 0; i < parts.size(); ++i)
            for (std::uint32_t k = 0; k < 3; ++k)
                if (const std::uint32_t p = parts[i].corner[k]; p >= given) add(p - given, 3 * i + k);
    });
    std::vector<Home> home(parts.size());
    parallelChunks(parts.size(), 32, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) home[i] = homeOf(parts[i]);
    });
    std::vector<std::uint32_t> firstAlike(3 * parts.size());
    std::vector<Made> made(firstAlike.size());
    parallelChunks(points_.size(), 32, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p) {
            const auto slots = slotsAt[p];
            if (slots.empty()) continue;
            const Vec3& X = points_[p].X;
            const std::optional<SkinPlace> ofAll = awayFromSeams(parts[slots[0] / 3].triangle, X);
            std::uint32_t alike = slots[0];
            for (const std::uint32_t s : slots) {
                if (!ofAll && home[s / 3] != home[alike / 3]) alike = s;
                firstAlike[s] = alike;
                if (alike == s) made[s] = madeAt(home[s / 3], X, ofAll);
            }
        }
    });
    std::vector<std::array<Corner, 3>> corners(parts.size());
    for (std::uint32_t i = 0; i < parts.size(); ++i)
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t point = parts[i].corner[k], slot = 3 * i + k, alike = firstAlike[slot];
            if (point < given)
                corners[i][k] = this->given(parts[i], point, home[i]);
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

/// The triangle that the part is of, or where its middle lies if that is on another side of a seam.
SkinCorners::Home SkinCorners::homeOf(const SkinCut::Part& part) const
{
    Home home{part.triangle, part.triangle};
    if (seams_.uvIsland.empty() && seams_.normalIsland.empty()) return home;
    const Vec3 middle = (place(part.corner[0]) + place(part.corner[1]) + place(part.corner[2])) / 3;
    const auto anyway = [](std::uint32_t, std::uint32_t, std::uint32_t) { return true; };
    const std::uint32_t there = nearest(skin_.topology, part.triangle, middle, anyway).triangle;
    const auto isBeyond = [&](const std::vector<std::uint32_t>& island) {
        return !island.empty() && island[there] != island[part.triangle];
    };
    if (isBeyond(seams_.uvIsland)) home.uv = there;
    if (isBeyond(seams_.normalIsland)) home.normal = there;
    return home;
}

/// A corner of the surface as it was given has what the part's triangle has there, unless the part has gone elsewhere.
Corner SkinCorners::given(const SkinCut::Part& part, std::uint32_t point, const Home& home)
{
    Corner corner;
    for (std::size_t own = 0; own < 3; ++own)
        if (const Corner& c = skin_.corner(part.triangle, own); c.point == point) corner = c;
    if (home == Home{part.triangle, part.triangle}) return corner;
    const Made made = madeAt(home, place(point), {});
    if (home.uv != part.triangle) corner.uv = addTo(drawn_.uvs, made.uv);
    if (home.normal != part.triangle) corner.normal = addTo(drawn_.normals, made.normal);
    return corner;
}

/// Where a point lies that started at a triangle, or on its rim; nothing where the way there comes near a seam.
std::optional<SkinPlace> SkinCorners::awayFromSeams(std::uint32_t triangle, const Vec3& X) const
{
    bool isClear = true;
    const SkinPlace place = nearest(skin_.topology, triangle, X, [&](std::uint32_t, std::uint32_t from, std::uint32_t) {
        const auto isSeam = [&](std::uint32_t p) { return seams_.isAt[p] != 0; };
        isClear = isClear && std::ranges::none_of(skin_.topology.triangles[from], isSeam);
        return isClear;
    });
    return isClear ? std::optional(place) : std::nullopt;
}

SkinCorners::Made SkinCorners::madeAt(const Home& home, const Vec3& X, const std::optional<SkinPlace>& place) const
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
    Made made{value(kUv, home.uv), value(kNormal, home.normal)};
    if (made.normal) made.normal->normalize();
    return made;
}

}  // namespace vdbfrac::skin
