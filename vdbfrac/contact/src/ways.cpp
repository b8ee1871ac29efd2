#include <vdbfrac/contact/ways.h>

#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace vdbfrac::contact {

namespace {

Vec3 meanOf(std::span<const Vec3> values)
{
    const Vec3 sum = std::accumulate(values.begin(), values.end(), Vec3(Vec3::Zero()));
    return values.empty() ? sum : Vec3(sum / double(values.size()));
}

/// A way, cut off where it is longer than `farthest`.
Vec3 upTo(double farthest, const Vec3& way)
{
    return std::min(1., farthest / std::max(way.norm(), farthest * 1e-9)) * way;
}

}  // namespace

std::vector<Vec3> ahead(std::span<const Vec3> x, std::span<const Vec3> v, double dt, double farthest)
{
    std::vector<Vec3> there(x.begin(), x.end());
    const Vec3 common = meanOf(v);
    for (std::size_t i = 0; std::isfinite(dt) && i < there.size(); ++i)
        there[i] += upTo(farthest, dt * (v[i] - common));
    return there;
}

std::vector<Vec3> wayTo(std::span<const Vec3> x, std::span<const Vec3> to, double farthest)
{
    const Vec3 common = meanOf(to) - meanOf(x);
    std::vector<Vec3> there(x.begin(), x.end());
    for (std::size_t i = 0; i < there.size(); ++i) there[i] += upTo(farthest, to[i] - common - x[i]);
    return there;
}

void WayBoxes::set(std::span<const Vec3> from, std::span<const Vec3> to)
{
    low.assign(from.begin(), from.end()), high.assign(from.begin(), from.end());
    add(to);
}

void WayBoxes::add(std::span<const Vec3> points)
{
    for (std::size_t n = 0; n < points.size(); ++n)
        low[n] = low[n].cwiseMin(points[n]), high[n] = high[n].cwiseMax(points[n]);
}

double WayBoxes::farthestBeside(std::span<const Vec3> points) const
{
    return orderedMax(points.size(), kChunk, 0, [&](std::size_t begin, std::size_t end) {
        double most = 0;
        for (std::size_t n = begin; n < end; ++n) {
            const Vec3 inside = points[n].cwiseMax(low[n]).cwiseMin(high[n]);
            most = std::max(most, (points[n] - inside).cwiseAbs().maxCoeff());
        }
        return most;
    });
}

double farthestMove(std::span<const Vec3> from, std::span<const Vec3> to)
{
    const Vec3 common = meanOf(to) - meanOf(from);
    return orderedMax(from.size(), kChunk, 0, [&](std::size_t begin, std::size_t end) {
        double most = 0;
        for (std::size_t i = begin; i < end; ++i)
            most = std::max(most, (to[i] - from[i] - common).cwiseAbs().maxCoeff());
        return most;
    });
}

}  // namespace vdbfrac::contact
