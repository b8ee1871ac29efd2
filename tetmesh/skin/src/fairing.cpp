#include "fairing.h"

#include "slider.h"

#include <vdbfrac/base/parallel.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace vdbfrac::skin {

namespace {

constexpr double kSpacing = 0.5;  // voxels: about how far points of a torn face are apart

/// Points that each point is faired by, with weights that add up to 1: those of point i are start[i] to start[i + 1].
struct Surroundings {
    std::vector<std::uint32_t> start{0}, point;
    std::vector<double> weight;
    std::vector<std::uint8_t> isEnd;  // of each point: is it at an end of a crack, where the rim turns back?

    void add(std::uint32_t p, double w) { point.push_back(p), weight.push_back(w); }
    void end()
    {
        double sum = 0;
        for (std::size_t k = start.back(); k < point.size(); ++k) sum += weight[k];
        for (std::size_t k = start.back(); k < point.size(); ++k) weight[k] /= sum;
        start.push_back(std::uint32_t(point.size()));
    }
};

/// A point in a torn face is faired by those next to it, one on a rim by those along it: by the nearest on either side,
/// and where the outer surface has many triangles to a voxel by all within a stretch, so that what is evened depends
/// on the voxels alone.
class SurroundingsOf {
public:
    SurroundingsOf(const std::vector<SkinCut::Point>& points, Groups neighbours, double dx) : points_(points), dx_(dx)
    {
        const std::uint32_t count = std::uint32_t(points.size());
        const auto begin = neighbours.item.begin();
        for (std::uint32_t i = 0; i < count; ++i)
            std::sort(begin + neighbours.start[i], begin + neighbours.start[i + 1]);
        next_ = groupItems(count, [&](const auto& add) {
            for (std::uint32_t i = 0; i < count; ++i) {
                const auto all = neighbours[i];
                for (auto at = all.begin(); at != all.end();) {
                    const auto end = std::upper_bound(at, all.end(), *at);
                    if (!isRim(i) || end - at == 1) add(i, *at);  // an edge of one triangle alone is on the rim
                    at = end;
                }
            }
        });
    }

    Surroundings make() const
    {
        Surroundings all;
        for (std::uint32_t i = 0; i < points_.size(); ++i) {
            all.isEnd.push_back(isRim(i) && turnsBack(i));
            if (isRim(i))
                for (const std::uint32_t next : next_[i]) addAlong(i, next, all);
            else
                for (const std::uint32_t next : next_[i]) all.add(next, isRim(next) ? share(next) : 1);
            all.end();
        }
        return all;
    }

private:
    bool isRim(std::uint32_t i) const { return points_[i].skin != SkinCut::kNoSkin; }
    double distance(std::uint32_t i, std::uint32_t j) const { return (points_[i].X - points_[j].X).norm(); }

    /// Points of a dense rim count together for as many as a coarse one would have.
    double share(std::uint32_t rim) const
    {
        double length = 0;
        for (const std::uint32_t next : next_[rim]) length += 0.5 * distance(rim, next);
        return std::min(1., length / (kSpacing * dx_));
    }

    /// Calls visit(point) for the points of a rim from one on, on the side of `next`: for that, and as far as `reach`.
    /// Returns the length of the way [m].
    template <class Visit>
    double goAlong(std::uint32_t from, std::uint32_t next, double reach, const Visit& visit) const
    {
        std::uint32_t before = from;
        double length = distance(from, next);
        while (true) {
            visit(next);
            if (next_[next].size() != 2) return length;
            const std::uint32_t after = next_[next][next_[next][0] == before];
            const double further = length + distance(next, after);
            if (after == from || further > reach) return length;
            length = further;
            before = next, next = after;
        }
    }

    /// The points of a rim from one on; together they count for 1.
    void addAlong(std::uint32_t from, std::uint32_t next, Surroundings& all) const
    {
        const double reach = kSpacing * std::sqrt(3.) * dx_;  // of the same variance as two points a spacing away
        const std::size_t first = all.point.size();
        goAlong(from, next, reach, [&](std::uint32_t p) { all.add(p, 1); });
        for (std::size_t k = first; k < all.point.size(); ++k) all.weight[k] = 1. / double(all.point.size() - first);
    }

    /// Do the two ways along the rim end beside each other? Both lips have been moved to their middle.
    bool turnsBack(std::uint32_t from) const
    {
        constexpr double kWay = 2, kBeside = 0.07;  // voxels; of the length of both, .7 at a right angle
        if (next_[from].size() != 2) return false;
        std::array<std::uint32_t, 2> end{};
        double length = 0;
        for (std::size_t k = 0; k < 2; ++k)
            length += goAlong(from, next_[from][k], kWay * dx_, [&](std::uint32_t p) { end[k] = p; });
        return distance(end[0], end[1]) < kBeside * length;
    }

    const std::vector<SkinCut::Point>& points_;
    double dx_;
    Groups next_;  // of each point; of one on a rim only those along it
};

}  // namespace

Groups neighboursOf(const SkinCut& cut, std::uint32_t firstPoint)
{
    return pointsBeside(cut.points.size(), [&](const auto& visit) {
        for (const auto& [a, b, c] : cut.torn) visit(std::array{a - firstPoint, b - firstPoint, c - firstPoint});
    });
}

Vec3 within(double farthest, const Vec3& from, const Vec3& to)
{
    const double way = (to - from).norm();
    return way > farthest ? Vec3(from + farthest / way * (to - from)) : to;
}

std::vector<std::uint8_t> endsOfCracks(const SkinCut& cut, std::uint32_t firstPoint, double dx)
{
    return SurroundingsOf(cut.points, neighboursOf(cut, firstPoint), dx).make().isEnd;
}

/// Each point goes towards the mean of those round it, and in torn faces away from it again, which evens what is short
/// and keeps what is long (Taubin 1995); rims would keep their small loops.
void fair(const SkinTopology& skin, const Groups& neighbours, double dx, std::span<const double> share,
          std::vector<SkinCut::Point>& points)
{
    constexpr int kRounds = 15;  // with points half a voxel apart: .02 is left of what is 2 voxels long, .8 of 4
    constexpr double kTowards = 0.5, kAway = -0.53;
    constexpr double kLeastLoop = 0.02;  // voxels: rims of cracks that have just begun do not shrink to points
    constexpr double kDrawnBack = 0.25;  // voxels: the end of a crack stays where the material parts
    const Surroundings round = SurroundingsOf(points, neighbours, dx).make();
    const Slider slider(skin);
    std::vector<Vec3> moved(points.size()), start(points.size());
    for (std::size_t i = 0; i < start.size(); ++i) start[i] = points[i].X;
    for (int half = 0; half < 2 * kRounds; ++half) {
        const double inFace = half % 2 == 0 ? kTowards : kAway;
        parallelChunks(points.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const bool isRim = points[i].skin != SkinCut::kNoSkin;
                moved[i] = points[i].X;
                if (share[i] > 0 && round.start[i + 1] > round.start[i]) {
                    Vec3 mean = Vec3::Zero();
                    double farthest = 0;
                    for (std::uint32_t k = round.start[i]; k < round.start[i + 1]; ++k) {
                        const Vec3& X = points[round.point[k]].X;
                        mean += round.weight[k] * X;
                        farthest = std::max(farthest, (X - points[i].X).squaredNorm());
                    }
                    if (isRim && farthest < kLeastLoop * kLeastLoop * dx * dx) continue;
                    moved[i] += share[i] * (isRim ? kTowards : inFace) * (mean - points[i].X);
                    if (round.isEnd[i]) moved[i] = within(kDrawnBack * dx, start[i], moved[i]);
                }
                if (isRim) moved[i] = slider.closest(points[i], moved[i], points[i].on);
            }
        });
        for (std::size_t i = 0; i < points.size(); ++i) points[i].X = moved[i];
    }
}

std::vector<std::uint32_t> unfold(const Groups& neighbours, std::uint32_t firstPoint, SkinCut& cut)
{
    std::vector<Vec3> area(cut.torn.size()), round(cut.points.size(), Vec3::Zero());
    const auto corner = [&](std::size_t f, std::size_t k) { return cut.torn[f][k] - firstPoint; };
    for (std::size_t f = 0; f < area.size(); ++f) {
        const Vec3& X = cut.points[corner(f, 0)].X;
        area[f] = (cut.points[corner(f, 1)].X - X).cross(cut.points[corner(f, 2)].X - X);
        for (std::size_t k = 0; k < 3; ++k) round[corner(f, k)] += area[f];
    }
    std::vector<std::uint8_t> isFolded(cut.points.size(), 0);
    for (std::size_t f = 0; f < area.size(); ++f)
        for (std::size_t k = 0; k < 3; ++k)
            if (area[f].dot(round[corner(f, k)]) < 0)
                for (std::size_t c = 0; c < 3; ++c) isFolded[corner(f, c)] = 1;
    std::vector<std::uint32_t> moved;
    std::vector<Vec3> middle;
    for (std::uint32_t i = 0; i < isFolded.size(); ++i) {
        if (!isFolded[i] || cut.points[i].skin != SkinCut::kNoSkin) continue;
        Vec3 mean = Vec3::Zero();
        for (const std::uint32_t next : neighbours[i]) mean += cut.points[next].X / double(neighbours[i].size());
        moved.push_back(i), middle.push_back(mean);
    }
    for (std::size_t m = 0; m < moved.size(); ++m) cut.points[moved[m]].X = middle[m];
    return moved;
}

}  // namespace vdbfrac::skin
