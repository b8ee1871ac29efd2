#include "unfolded_parts.h"

#include "fairing.h"
#include "fitted_parts.h"
#include "redivide.h"
#include "slider.h"

#include <vdbfrac/base/grouping.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace vdbfrac::skin {

namespace {

constexpr int kRounds = 20;
constexpr double kSeen = 1e-4;      // square voxels
constexpr double kDrawnBack = 0.1;  // voxels: ends of cracks

/// Of points of the cut the corners next to them on the outer surface; of those on a rim the ones along it.
Groups besideOf(const SkinTopology& skin, const SkinCut& cut)
{
    using Edge = std::pair<std::uint32_t, std::uint32_t>;
    const std::size_t given = skin.pointOf.size();
    std::vector<Edge> torn, rim, others;
    for (const auto& face : cut.torn)
        for (std::size_t k = 0; k < 3; ++k) torn.emplace_back(face[k], face[(k + 1) % 3]);
    std::ranges::sort(torn);
    for (const SkinCut::Part& part : cut.parts)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t a = part.corner[k], b = part.corner[(k + 1) % 3];
            std::vector<Edge>& edges = std::ranges::binary_search(torn, Edge(b, a)) ? rim : others;
            edges.emplace_back(a, b), edges.emplace_back(b, a);
        }
    sortUnique(others);
    std::vector<std::uint8_t> isRim(cut.points.size(), 0);
    for (const auto& [a, b] : rim) isRim[a - given] = 1;
    return groupItems(cut.points.size(), [&](const auto& add) {
        for (const auto& [a, b] : rim) add(a - given, b);
        for (const auto& [a, b] : others)
            if (a >= given && !isRim[a - given]) add(a - given, b);
    });
}

/// Points of the cut that parts which look inward have, sorted.
std::vector<std::uint32_t> foldedPoints(const SkinTopology& skin, double dx, const SkinCut& cut)
{
    const auto given = std::uint32_t(skin.pointOf.size());
    std::vector<std::uint32_t> folded;
    for (const SkinCut::Part& part : cut.parts)
        if (outwardArea(skin, cut.points, part) < -kSeen * dx * dx)
            for (const std::uint32_t c : part.corner)
                if (c >= given) folded.push_back(c - given);
    sortUnique(folded);
    return folded;
}

}  // namespace

void unfoldParts(const SkinTopology& skin, double dx, std::span<const std::uint8_t> isFixed, SkinCut& cut)
{
    std::vector<std::uint32_t> folded = foldedPoints(skin, dx, cut);
    if (folded.empty()) return;
    const Groups beside = besideOf(skin, cut);
    const std::vector<std::uint8_t> isEnd = endsOfCracks(cut, std::uint32_t(skin.pointOf.size()), dx);
    const Slider slider(skin);
    std::vector<Vec3> start;
    for (const SkinCut::Point& point : cut.points) start.push_back(point.X);
    std::vector<std::uint8_t> isMoved(cut.points.size(), 0);
    for (int round = 0; round < kRounds && !folded.empty(); ++round) {
        std::erase_if(folded, [&](std::uint32_t p) { return isFixed[p] || beside[p].empty(); });
        std::vector<Vec3> mean;
        for (const std::uint32_t p : folded) {
            Vec3 sum = Vec3::Zero();
            for (const std::uint32_t next : beside[p]) sum += placeOf(skin, cut.points, next);
            mean.push_back(sum / double(beside[p].size()));
            if (isEnd[p]) mean.back() = within(kDrawnBack * dx, start[p], mean.back());
        }
        for (std::size_t i = 0; i < folded.size(); ++i) {
            SkinCut::Point& point = cut.points[folded[i]];
            point.X = slider.closest(point, mean[i], point.on);
            isMoved[folded[i]] = 1;
        }
        folded = foldedPoints(skin, dx, cut);
    }
    redivide(skin, isMoved, cut);
}

}  // namespace vdbfrac::skin
