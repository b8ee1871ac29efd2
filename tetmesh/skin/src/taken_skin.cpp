#include "taken_skin.h"

#include "fitted_parts.h"
#include "slider.h"

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/nearest_source.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

namespace vdbfrac::skin {

namespace {

/// Points of the cut that what is kept has.
std::vector<std::uint8_t> rimPoints(const SkinCut& cut, std::uint32_t given)
{
    std::vector<std::uint8_t> isRim(cut.points.size(), 0);
    for (const SkinCut::Part& part : cut.parts)
        for (const std::uint32_t c : part.corner)
            if (c >= given) isRim[c - given] = 1;
    return isRim;
}

/// Points of the cut, by the edges of the parts in cracks.
Groups linksOf(const SkinCut& cut, std::uint32_t given)
{
    return pointsBeside(cut.points.size(), [&](const auto& visit) {
        for (const SkinCut::Part& part : cut.taken)
            visit(std::array{part.corner[0] - given, part.corner[1] - given, part.corner[2] - given});
    });
}

}  // namespace

void fitTaken(const SkinTopology& skin, double dx, std::span<const SkinCut::Point> made, SkinCut& cut)
{
    const auto given = std::uint32_t(skin.pointOf.size());
    std::ranges::stable_sort(cut.taken, {}, &SkinCut::Part::triangle);
    std::vector<std::uint8_t> isRim = rimPoints(cut, given);
    const std::size_t before = cut.points.size();
    const std::vector<PlaceOnSkin> places = placesOf(skin, cut.taken, [](std::uint32_t) { return true; });
    copyGiven(skin, places, cut.taken, cut.points);
    isRim.resize(cut.points.size(), 0);
    const Groups links = linksOf(cut, given);
    const std::vector<std::uint32_t> nearest = nearestSources(links, isRim);
    for (std::size_t i = 0; i < cut.points.size(); ++i)
        if (!links[i].empty() && !isRim[i])
            cut.points[i].anchor = nearest[i] != kNoSource ? cut.points[nearest[i]].anchor
                                                           : tetmesh::floorOf(cut.points[i].X.array() / dx + .5);
    if (made.empty()) return;
    std::vector<Vec3> X(cut.points.size()), rimShift(cut.points.size(), Vec3::Zero());
    for (std::size_t i = 0; i < X.size(); ++i) X[i] = i < before ? made[i].X : cut.points[i].X;
    for (std::size_t i = 0; i < before; ++i)
        if (isRim[i]) rimShift[i] = cut.points[i].X - X[i];
    std::vector<std::uint8_t> isFree(cut.points.size(), 0);
    for (std::uint32_t i = 0; i < isFree.size(); ++i) {
        isFree[i] = nearest[i] != kNoSource && nearest[i] != i;
        if (isFree[i]) rimShift[i] = rimShift[nearest[i]];
    }
    const std::vector<Vec3> shift = harmonic(skin, cut.taken, X, isFree, std::move(rimShift), Weights::exact);
    const Slider slider(skin);
    for (std::size_t i = 0; i < cut.points.size(); ++i) {
        if (links[i].empty() || isRim[i]) continue;
        SkinCut::Point& point = cut.points[i];
        if (i < before) point.X = made[i].X, point.on = made[i].on;
        if (i < before || !places[i - before].isCorner) point.X = slider.closest(point, point.X + shift[i], point.on);
    }
}

}  // namespace vdbfrac::skin
