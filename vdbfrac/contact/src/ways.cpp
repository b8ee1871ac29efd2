#include <vdbfrac/contact/ways.h>

#include <vdbfrac/base/parallel.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

namespace vdbfrac::contact {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Vec3 meanOf(std::span<const Vec3> values)
{
    const Vec3 sum = std::accumulate(values.begin(), values.end(), Vec3(Vec3::Zero()));
    return values.empty() ? sum : Vec3(sum / double(values.size()));
}

/// The mean of all, or of each fragment.
class Means {
public:
    Means(std::span<const Vec3> values, std::span<const std::uint32_t> fragment) : fragment_(fragment)
    {
        if (fragment.empty()) {
            mean_ = {meanOf(values)};
            return;
        }
        std::vector<double> count;
        for (std::size_t n = 0; n < values.size(); ++n) {
            if (fragment[n] >= mean_.size())
                mean_.resize(fragment[n] + 1, Vec3::Zero()), count.resize(fragment[n] + 1, 0);
            mean_[fragment[n]] += values[n], ++count[fragment[n]];
        }
        for (std::size_t f = 0; f < mean_.size(); ++f) mean_[f] /= std::max(1., count[f]);
    }
    const Vec3& operator()(std::size_t node) const { return mean_[fragment_.empty() ? 0 : fragment_[node]]; }

private:
    std::span<const std::uint32_t> fragment_;
    std::vector<Vec3> mean_;
};

/// The ends of ways from x, cut off where they are longer than `farthest`.
template <class Way>
std::vector<Vec3> ends(std::span<const Vec3> x, double farthest, const Way& wayOf)
{
    std::vector<Vec3> there(x.begin(), x.end());
    for (std::size_t n = 0; n < there.size(); ++n) {
        const Vec3 way = wayOf(n);
        there[n] += std::min(1., farthest / std::max(way.norm(), farthest * 1e-9)) * way;
    }
    return there;
}

/// Where a fragment is on its way, and how far one of its nodes goes along an axis [m].
struct Swept {
    Eigen::AlignedBox3d box;
    double farthest = 0;
};

/// By the numbers of fragments.
std::vector<Swept> sweptBy(std::span<const core::Body> bodies, std::span<const Vec3> from, std::span<const Vec3> to)
{
    std::vector<Swept> swept;
    const Vec3 common = meanOf(to) - meanOf(from);
    for (const core::Body& body : bodies)
        for (std::size_t i = 0; i < body.fragments.ofNode().size(); ++i) {
            const std::uint32_t fragment = body.fragments.ofNode()[i];
            if (fragment >= swept.size()) swept.resize(fragment + 1);
            Swept& own = swept[fragment];
            const Vec3 &a = from[body.firstNode + i], b = to[body.firstNode + i] - common;
            own.box.extend(a).extend(b);
            own.farthest = std::max(own.farthest, (b - a).cwiseAbs().maxCoeff());
        }
    return swept;
}

}  // namespace

std::vector<Vec3> moved(std::span<const Vec3> x, std::span<const Vec3> v, double dt)
{
    std::vector<Vec3> there(x.begin(), x.end());
    for (std::size_t n = 0; n < there.size(); ++n) there[n] += dt * v[n];
    return there;
}

std::vector<Vec3> ahead(std::span<const Vec3> x, std::span<const Vec3> v, double dt, double farthest,
                        std::span<const std::uint32_t> fragment)
{
    if (!std::isfinite(dt)) return {x.begin(), x.end()};
    return ends(x, farthest,
                [&, common = Means(v, fragment)](std::size_t n) -> Vec3 { return dt * (v[n] - common(n)); });
}

std::vector<Vec3> wayTo(std::span<const Vec3> x, std::span<const Vec3> to, double farthest,
                        std::span<const std::uint32_t> fragment)
{
    const Means then(x, fragment), now(to, fragment);
    return ends(x, farthest, [&](std::size_t n) -> Vec3 { return to[n] - (now(n) - then(n)) - x[n]; });
}

bool mayMeet(const Ways& ways, std::span<const std::uint32_t> fragment, double margin)
{
    std::vector<Eigen::AlignedBox3d> boxes;
    for (std::size_t n = 0; n < fragment.size(); ++n) {
        if (fragment[n] >= boxes.size()) boxes.resize(fragment[n] + 1);
        boxes[fragment[n]].extend(ways.from[n]).extend(ways.to[n]);
    }
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        if (boxes[i].isEmpty()) continue;  // of a fragment that is gone
        const Vec3 room = Vec3::Constant(margin);
        const Eigen::AlignedBox3d wide(boxes[i].min() - room, boxes[i].max() + room);
        for (std::size_t j = 0; j < i; ++j)
            if (wide.intersects(boxes[j])) return true;
    }
    return false;
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

double partFollowed(std::span<const core::Body> bodies, std::span<const Vec3> from, std::span<const Vec3> to,
                    double farthest)
{
    double part = kInfinity;
    if (farthestMove(from, to) <= farthest) return part;
    const std::vector<Swept> swept = sweptBy(bodies, from, to);
    for (std::size_t i = 0; i < swept.size(); ++i)
        for (std::size_t j = 0; j < swept.size() && swept[i].farthest > farthest; ++j)
            if (i != j && swept[i].box.intersects(swept[j].box)) part = std::min(part, farthest / swept[i].farthest);
    return part;
}

}  // namespace vdbfrac::contact
