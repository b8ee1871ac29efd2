#include "kept_skin.h"

#include "fitted_parts.h"
#include "redivide.h"
#include "slider.h"
#include "unfolded_parts.h"

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/nearest_source.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace vdbfrac::skin {

namespace {

using Triangles = std::span<const std::array<std::uint32_t, 3>>;

/// Of each place of the outer surface the one among corners of parts that look inward from which it is reached over
/// triangles that are kept, no farther than `reach` [m] from it; kNoSource where there is none.
std::vector<std::uint32_t> placesNear(const SkinTopology& skin, const SkinCut& cut, double reach)
{
    constexpr double kSeen = 1e-4;  // of the square of the reach
    const std::size_t given = skin.pointOf.size();
    std::vector<std::uint32_t> nearest(skin.points.size(), kNoSource), reached;
    for (const SkinCut::Part& part : cut.parts) {
        if (!(outwardArea(skin, cut.points, part) < -kSeen * reach * reach)) continue;
        for (const std::uint32_t c : part.corner)
            if (c < given && nearest[skin.pointOf[c]] == kNoSource)
                nearest[skin.pointOf[c]] = skin.pointOf[c], reached.push_back(skin.pointOf[c]);
    }
    if (reached.empty()) return nearest;
    const auto isKept = [&](std::size_t t) { return cut.fate[t] == SkinCut::Fate::kept; };
    const Groups links = groupItems(skin.points.size(), [&](const auto& add) {
        const auto addEdge = [&](std::uint32_t a, std::uint32_t b) { add(a, b), add(b, a); };
        for (std::size_t t = 0; t < skin.triangles.size(); ++t)
            for (std::size_t k = 0; k < 3 && isKept(t); ++k)
                addEdge(skin.triangles[t][k], skin.triangles[t][(k + 1) % 3]);
        for (const SkinCut::Part& part : cut.parts)
            for (std::size_t k = 0; k < 3; ++k)
                if (const std::uint32_t a = part.corner[k], b = part.corner[(k + 1) % 3]; a < given && b < given)
                    addEdge(skin.pointOf[a], skin.pointOf[b]);
    });
    for (std::size_t r = 0; r < reached.size(); ++r)
        for (const std::uint32_t next : links[reached[r]]) {
            const std::uint32_t source = nearest[reached[r]];
            if (nearest[next] != kNoSource || (skin.points[next] - skin.points[source]).norm() > reach) continue;
            nearest[next] = source, reached.push_back(next);
        }
    return nearest;
}

/// Makes parts of whole triangles that have one of these places.
void addWhole(const SkinTopology& skin, std::span<const std::uint32_t> nearest, Triangles given, SkinCut& cut)
{
    for (std::uint32_t t = 0; t < given.size(); ++t) {
        if (cut.fate[t] != SkinCut::Fate::kept) continue;
        if (std::ranges::all_of(skin.triangles[t], [&](std::uint32_t p) { return nearest[p] == kNoSource; })) continue;
        cut.fate[t] = SkinCut::Fate::cut;
        cut.parts.push_back({t, given[t]});
    }
    std::ranges::stable_sort(cut.parts, {}, &SkinCut::Part::triangle);
}

/// Lets corners of the outer surface go along with the rims beside them. Returns which points of the cut may not move.
std::vector<std::uint8_t> moveAlong(const SkinTopology& skin, double dx, std::span<const SkinCut::Point> made,
                                    Triangles given, SkinCut& cut)
{
    constexpr double kReach = 2;  // voxels: rims move by up to one
    const std::vector<std::uint32_t> nearest = placesNear(skin, cut, kReach * dx);
    if (std::ranges::all_of(nearest, [](std::uint32_t source) { return source == kNoSource; }))
        return std::vector<std::uint8_t>(cut.points.size(), 0);
    addWhole(skin, nearest, given, cut);
    const std::size_t before = cut.points.size();
    const std::vector<PlaceOnSkin> places =
        placesOf(skin, cut.parts, [&](std::uint32_t place) { return nearest[place] != kNoSource; });
    copyGiven(skin, places, cut.parts, cut.points);
    std::vector<Vec3> X(cut.points.size()), shift(cut.points.size(), Vec3::Zero());
    std::vector<std::uint8_t> isAdded(cut.points.size(), 0), isFixed = isAdded, isFree = isAdded;
    for (std::size_t i = 0; i < X.size(); ++i) {
        X[i] = i < made.size() ? made[i].X : cut.points[i].X;
        shift[i] = cut.points[i].X - X[i];
    }
    for (std::size_t i = before; i < X.size(); ++i) {
        cut.points[i].anchor = cut.anchor[places[i - before].given];
        isAdded[i] = 1, isFixed[i] = places[i - before].isCorner, isFree[i] = !isFixed[i];
    }
    shift = harmonic(skin, cut.parts, X, isFree, std::move(shift), Weights::positive);
    const Slider slider(skin);
    for (std::size_t i = before; i < X.size(); ++i)
        if (isFree[i]) cut.points[i].X = slider.closest(cut.points[i], X[i] + shift[i], cut.points[i].on);
    redivide(skin, isAdded, cut);
    return isFixed;
}

}  // namespace

void fitKept(const SkinTopology& skin, double dx, std::span<const SkinCut::Point> made, Triangles given, SkinCut& cut)
{
    const std::vector<std::uint8_t> isFixed = moveAlong(skin, dx, made, given, cut);
    unfoldParts(skin, dx, isFixed, cut);
}

}  // namespace vdbfrac::skin
