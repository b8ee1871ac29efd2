#include <vdbfrac/contact/motion.h>

#include <vdbfrac/base/infinity.h>
#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace vdbfrac::contact {

namespace {

/// Where a fragment is on its way, and how far one of its nodes goes along an axis [m].
struct Swept {
    Box box;
    double farthest = 0;
};

/// By the numbers of fragments; seen from what moves by `common` [m].
std::vector<Swept> sweptBy(const Motion& motion, std::span<const std::uint32_t> fragment, const Vec3& common)
{
    std::vector<Swept> swept;
    for (std::size_t n = 0; n < fragment.size(); ++n) {
        if (fragment[n] >= swept.size()) swept.resize(fragment[n] + 1);
        Swept& own = swept[fragment[n]];
        const Vec3 &from = motion.from[n], to = motion.to[n] - common;
        own.box.extend(from).extend(to);
        own.farthest = std::max(own.farthest, (to - from).cwiseAbs().maxCoeff());
    }
    return swept;
}

}  // namespace

Means::Means(std::span<const Vec3> values, std::span<const std::uint32_t> fragment) : fragment_(fragment)
{
    constexpr std::size_t kEach = 8;
    const auto fragments = fragment.empty() ? 1 : *std::ranges::max_element(fragment) + std::size_t{1};
    mean_.assign(fragments, Vec3::Zero());
    std::vector<double> count(fragments, 0);
    const auto add = [&](std::size_t f, std::size_t n) { mean_[f] += values[n], ++count[f]; };
    for (std::size_t n = 0; n < values.size(); n += kEach) add(fragment.empty() ? 0 : fragment[n], n);
    if (std::ranges::find(count, 0.) != count.end())
        for (std::size_t n = 0; n < fragment.size(); ++n)
            if (count[fragment[n]] == 0) add(fragment[n], n);
    for (std::size_t f = 0; f < fragments; ++f) mean_[f] /= std::max(1., count[f]);
}

RelativeMotion RelativeMotion::ahead(std::span<const Vec3> x, std::span<const Vec3> v, double dt, double farthest,
                                     std::span<const std::uint32_t> fragment)
{
    return {x, v, std::isfinite(dt) ? dt : 0, 0, farthest, Means(v, fragment), Means({})};
}

RelativeMotion RelativeMotion::gone(std::span<const Vec3> x, std::span<const Vec3> to, double farthest,
                                    std::span<const std::uint32_t> fragment)
{
    return {x, to, 1, 1, farthest, Means(to, fragment), Means(x, fragment)};
}

std::vector<Vec3> RelativeMotion::ends() const
{
    std::vector<Vec3> there(x_.size());
    parallelChunks(there.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n) there[n] = (*this)(n);
    });
    return there;
}

double RelativeMotion::farthestBeside(const Motion& motion) const
{
    return orderedMax(x_.size(), kChunk, 0, [&](std::size_t begin, std::size_t end) {
        double most = 0;
        for (std::size_t n = begin; n < end; ++n) {
            const Box box = Box(motion.from[n]).extend(motion.to[n]);
            const Vec3 point = (*this)(n), inside = point.cwiseMax(box.min()).cwiseMin(box.max());
            most = std::max(most, (point - inside).cwiseAbs().maxCoeff());
        }
        return most;
    });
}

MotionBoxes RelativeMotion::boxesWith(const Motion& motion) const
{
    MotionBoxes boxes{std::vector<Vec3>(x_.size()), std::vector<Vec3>(x_.size())};
    parallelChunks(x_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n) {
            const Box box = Box(motion.from[n]).extend(motion.to[n]).extend((*this)(n));
            boxes.low[n] = box.min(), boxes.high[n] = box.max();
        }
    });
    return boxes;
}

std::vector<Vec3> moved(std::span<const Vec3> x, std::span<const Vec3> v, double dt)
{
    std::vector<Vec3> there(x.size());
    parallelChunks(there.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n) there[n] = x[n] + dt * v[n];
    });
    return there;
}

bool mayMeet(const Motion& motion, std::span<const std::uint32_t> fragment, double margin)
{
    const std::vector<Swept> swept = sweptBy(motion, fragment, Vec3::Zero());
    for (std::size_t i = 0; i < swept.size(); ++i) {
        if (swept[i].box.isEmpty()) continue;  // of a fragment that is gone
        const Box wide = wider(swept[i].box, margin);
        for (std::size_t j = 0; j < i; ++j)
            if (wide.intersects(swept[j].box)) return true;
    }
    return false;
}

double farthestMove(std::span<const Vec3> from, std::span<const Vec3> to, std::span<const std::uint32_t> fragment)
{
    const Means then(from, fragment), now(to, fragment);
    return orderedMax(from.size(), kChunk, 0, [&](std::size_t begin, std::size_t end) {
        double most = 0;
        for (std::size_t i = begin; i < end; ++i)
            most = std::max(most, (to[i] - from[i] - (now(i) - then(i))).cwiseAbs().maxCoeff());
        return most;
    });
}

double partFollowed(const Motion& motion, std::span<const std::uint32_t> fragment, double farthest)
{
    double part = kInfinity;
    if (farthestMove(motion.from, motion.to) <= farthest) return part;
    const Vec3 common = Means(motion.to)(0) - Means(motion.from)(0);
    const std::vector<Swept> swept = sweptBy(motion, fragment, common);
    for (std::size_t i = 0; i < swept.size(); ++i)
        for (std::size_t j = 0; j < swept.size() && swept[i].farthest > farthest; ++j)
            if (i != j && swept[i].box.intersects(swept[j].box)) part = std::min(part, farthest / swept[i].farthest);
    return part;
}

}  // namespace vdbfrac::contact
