#include <vdbfrac/contact/motion.h>

#include <vdbfrac/base/infinity.h>
#include <vdbfrac/base/parallel.h>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace vdbfrac::contact {

namespace {

constexpr std::size_t kNodes = 65536;  // a chunk: fewer are done before another thread has woken up

/// Where a fragment is on its way, and how far one of its nodes goes along an axis [m].
struct Swept {
    Box box;
    double farthest = 0;
};

/// By the numbers of fragments; seen from what moves by `common` [m].
std::vector<Swept> sweptBy(const Motion& motion, std::span<const std::uint32_t> fragment, const Vec3& common)
{
    std::vector<Swept> swept;
    for (std::size_t n = 0; n < fragment.size();) {
        const std::uint32_t f = fragment[n];
        if (f >= swept.size()) swept.resize(f + 1);
        Swept own = swept[f];  // nodes of a fragment mostly lie in a row: a copy stays in registers
        for (; n < fragment.size() && fragment[n] == f; ++n) {
            const Vec3 &from = motion.from[n], to = motion.to[n] - common;
            own.box.extend(from).extend(to);
            own.farthest = std::max(own.farthest, (to - from).cwiseAbs().maxCoeff());
        }
        swept[f] = own;
    }
    return swept;
}

/// Of places x and moves of nodes that have a say in where motion is seen from, about their means.
struct Moments {
    double count = 0;
    Vec3 x = Vec3::Zero(), move = Vec3::Zero();       // sums, then means
    Mat3 both = Mat3::Zero(), second = Mat3::Zero();  // of move x^T and x x^T
};

constexpr double kTurns = 4;  // nodes of a fragment that can tell how it turns

/// Of each fragment, or of all where `fragment` is empty.
std::vector<Moments> momentsOf(std::span<const Vec3> x, std::span<const Vec3> move,
                               std::span<const std::uint32_t> fragment)
{
    constexpr std::size_t kEach = 32;  // these nodes have a say, and all of a fragment with fewer than kFew of them
    constexpr double kFew = 8;
    const auto of = [&](std::size_t n) { return fragment.empty() ? 0u : fragment[n]; };
    std::vector<Moments> all(fragment.empty() ? 1 : *std::ranges::max_element(fragment) + std::size_t{1});
    std::vector<std::uint32_t> say;
    for (std::size_t n = 0; n < x.size(); n += kEach) say.push_back(std::uint32_t(n)), ++all[of(n)].count;
    const bool areFew = std::ranges::any_of(all, [](const Moments& m) { return m.count < kFew; });
    for (std::size_t n = 0; areFew && n < fragment.size(); ++n)
        if (n % kEach != 0 && all[of(n)].count < kFew) say.push_back(std::uint32_t(n));
    for (Moments& m : all) m.count = 0;
    for (const std::uint32_t n : say) {
        Moments& m = all[of(n)];
        ++m.count, m.x += x[n], m.move += move[n];
    }
    for (Moments& m : all) m.x /= std::max(1., m.count), m.move /= std::max(1., m.count);
    if (fragment.empty()) return all;
    for (const std::uint32_t n : say) {
        Moments& m = all[of(n)];
        const Vec3 r = x[n] - m.x;
        m.both += (move[n] - m.move) * r.transpose(), m.second += r * r.transpose();
    }
    return all;
}

constexpr double kDefinite = 1e-6;  // of what is fitted: where nodes lie in a line they do not turn about it

/// The angular velocity that velocities fit best, as an operator on places.
Mat3 spinOf(const Moments& m)
{
    Mat3 spin = Mat3::Zero();
    if (m.count < kTurns) return spin;
    const double size = m.second.trace();
    const Mat3 inertia = (1 + kDefinite) * size * Mat3::Identity() - m.second;
    const Vec3 momentum(m.both(2, 1) - m.both(1, 2), m.both(0, 2) - m.both(2, 0), m.both(1, 0) - m.both(0, 1));
    const Vec3 rate = inertia.ldlt().solve(momentum);
    if (size > 0 && rate.allFinite()) spin << 0, -rate.z(), rate.y(), rate.z(), 0, -rate.x(), -rate.y(), rate.x(), 0;
    return spin;
}

/// The rotation that takes places nearest to where they are now.
Mat3 turnOf(const Moments& m)
{
    if (m.count < kTurns || !m.both.allFinite()) return Mat3::Identity();
    const Eigen::JacobiSVD<Mat3> svd(m.both + kDefinite * m.both.norm() * Mat3::Identity(),
                                     Eigen::ComputeFullU | Eigen::ComputeFullV);
    const double side = (svd.matrixU() * svd.matrixV().transpose()).determinant();
    return svd.matrixU() * Vec3(1, 1, side).asDiagonal() * svd.matrixV().transpose();
}

}  // namespace

RelativeMotion::RelativeMotion(std::span<const Vec3> x, std::span<const Vec3> move, double scale, bool isGone,
                               double farthest, std::span<const std::uint32_t> fragment)
    : x_(x), move_(move), scale_(scale), farthest_(farthest), isGone_(isGone), fragment_(fragment)
{
}

RelativeMotion RelativeMotion::ahead(std::span<const Vec3> x, std::span<const Vec3> v, double dt, double farthest,
                                     std::span<const std::uint32_t> fragment)
{
    RelativeMotion motion(x, v, std::isfinite(dt) ? dt : 0, false, farthest, fragment);
    for (const Moments& m : momentsOf(x, v, fragment))
        motion.frames_.push_back({m.move, m.x, fragment.empty() ? Mat3(Mat3::Zero()) : spinOf(m)});
    return motion;
}

RelativeMotion RelativeMotion::gone(std::span<const Vec3> x, std::span<const Vec3> to, double farthest,
                                    std::span<const std::uint32_t> fragment)
{
    RelativeMotion motion(x, to, 1, true, farthest, fragment);
    for (const Moments& m : momentsOf(x, to, fragment))
        motion.frames_.push_back({m.move, m.x, fragment.empty() ? Mat3::Identity() : Mat3(turnOf(m).transpose())});
    return motion;
}

template <class Visit>
void RelativeMotion::eachWay(std::size_t begin, std::size_t end, const Visit& visit) const
{
    for (std::size_t n = begin; n < end;) {
        const std::uint32_t f = frameOf(n);
        const Frame own = frames_[f];  // nodes of a fragment mostly lie in a row: a copy stays in registers
        for (; n < end && frameOf(n) == f; ++n) {
            const Vec3 move = move_[n] - own.move, place = x_[n] - own.place;
            const Vec3 way = isGone_ ? Vec3(own.turn * move - place) : Vec3(scale_ * (move - own.turn * place));
            const double far = way.squaredNorm();
            if (!std::isfinite(far))
                visit(n, Vec3(Vec3::Zero()));  // what flies off to infinity meets nothing
            else
                visit(n, far > farthest_ * farthest_ ? Vec3(way * (farthest_ / std::sqrt(far))) : way);
        }
    }
}

std::vector<Vec3> RelativeMotion::ways() const
{
    std::vector<Vec3> all(x_.size());
    parallelChunks(all.size(), kNodes, [&](std::size_t begin, std::size_t end) {
        eachWay(begin, end, [&](std::size_t n, const Vec3& way) { all[n] = way; });
    });
    return all;
}

std::vector<Vec3> RelativeMotion::ends() const
{
    std::vector<Vec3> there(x_.size());
    parallelChunks(there.size(), kNodes, [&](std::size_t begin, std::size_t end) {
        eachWay(begin, end, [&](std::size_t n, const Vec3& way) { there[n] = x_[n] + way; });
    });
    return there;
}

double RelativeMotion::farthestAlongAxis() const
{
    return orderedMax(x_.size(), kNodes, 0, [&](std::size_t begin, std::size_t end) {
        double most = 0;
        eachWay(begin, end, [&](std::size_t, const Vec3& way) { most = std::max(most, way.cwiseAbs().maxCoeff()); });
        return most;
    });
}

double RelativeMotion::farthestBeside(const Motion& motion) const
{
    return orderedMax(x_.size(), kNodes, 0, [&](std::size_t begin, std::size_t end) {
        double most = 0;
        eachWay(begin, end, [&](std::size_t n, const Vec3& way) {
            const Box box = Box(motion.from[n]).extend(motion.to[n]);
            const Vec3 point = x_[n] + way, inside = point.cwiseMax(box.min()).cwiseMin(box.max());
            most = std::max(most, (point - inside).cwiseAbs().maxCoeff());
        });
        return most;
    });
}

MotionBoxes RelativeMotion::boxesWith(const Motion& motion) const
{
    MotionBoxes boxes{std::vector<Vec3>(x_.size()), std::vector<Vec3>(x_.size())};
    parallelChunks(x_.size(), kNodes, [&](std::size_t begin, std::size_t end) {
        eachWay(begin, end, [&](std::size_t n, const Vec3& way) {
            const Box box = Box(motion.from[n]).extend(motion.to[n]).extend(x_[n] + way);
            boxes.low[n] = box.min(), boxes.high[n] = box.max();
        });
    });
    return boxes;
}

std::vector<Vec3> moved(std::span<const Vec3> x, std::span<const Vec3> v, double dt)
{
    std::vector<Vec3> there(x.size());
    parallelChunks(there.size(), kNodes, [&](std::size_t begin, std::size_t end) {
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
    return RelativeMotion::gone(from, to, kInfinity, fragment).farthestAlongAxis();
}

double partFollowed(const Motion& motion, std::span<const std::uint32_t> fragment, double farthest)
{
    double part = kInfinity;
    if (farthestMove(motion.from, motion.to) <= farthest) return part;
    const Moments all = momentsOf(motion.from, motion.to, {})[0];
    const Vec3 common = all.move - all.x;
    const std::vector<Swept> swept = sweptBy(motion, fragment, common);
    for (std::size_t i = 0; i < swept.size(); ++i)
        for (std::size_t j = 0; j < swept.size() && swept[i].farthest > farthest; ++j)
            if (i != j && swept[i].box.intersects(swept[j].box)) part = std::min(part, farthest / swept[i].farthest);
    return part;
}

}  // namespace vdbfrac::contact
