#include <vdbfrac/scene/placement.h>

#include <vdbfrac/base/rotation.h>

#include <algorithm>
#include <numbers>

namespace vdbfrac::scene {

namespace {

/// The first key after a time.
auto keyAfter(const std::vector<PoseKey>& keys, double time)
{
    return std::upper_bound(keys.begin(), keys.end(), time, [](double t, const PoseKey& k) { return t < k.time; });
}

/// How fast a component of poses changes at a key, so that it is monotone between keys (Fritsch and Butland 1984): the
/// weighted harmonic mean of its changes before and after; 0 where they have different signs, and at both ends.
double rateAt(const std::vector<PoseKey>& keys, std::size_t key, Vec3 PoseKey::*part, int axis)
{
    if (key == 0 || key + 1 == keys.size()) return 0;
    const auto value = [&](std::size_t k) { return (keys[k].*part)[axis]; };
    const double before = keys[key].time - keys[key - 1].time, after = keys[key + 1].time - keys[key].time;
    const double a = (value(key) - value(key - 1)) / before, b = (value(key + 1) - value(key)) / after;
    if (!(a * b > 0)) return 0;
    const double wa = before + 2 * after, wb = 2 * before + after;
    return (wa + wb) / (wa / a + wb / b);
}

/// Poses and how they change [m/s, degrees/s].
struct Moving {
    PoseKey pose;
    Vec3 translate = Vec3::Zero(), rotate = Vec3::Zero();
};

/// Between a key and the next, at `s` from 0 to 1.
Moving between(const Keys& move, std::size_t key, double s)
{
    const PoseKey &a = move.keys[key], &b = move.keys[key + 1];
    const double length = b.time - a.time;
    Moving now{{a.time + s * length}};
    const auto set = [&](Vec3 PoseKey::*part, Vec3& rate) {
        for (int axis = 0; axis < 3; ++axis) {
            const double from = (a.*part)[axis], to = (b.*part)[axis], way = to - from;
            double& value = (now.pose.*part)[axis];
            if (!move.isSmooth) {
                value = (1 - s) * from + s * to, rate[axis] = way / length;
                continue;
            }
            // Hermite's cubic.
            const double first = length * rateAt(move.keys, key, part, axis),
                         last = length * rateAt(move.keys, key + 1, part, axis), square = 3 * way - 2 * first - last,
                         cube = first + last - 2 * way;
            value = from + s * (first + s * (square + s * cube));
            rate[axis] = (first + s * (2 * square + s * 3 * cube)) / length;
        }
    };
    set(&PoseKey::translate, now.translate), set(&PoseKey::rotate, now.rotate);
    return now;
}

Moving movingAt(const Keys& move, double time)
{
    const auto after = keyAfter(move.keys, time);
    if (after == move.keys.begin()) return {move.keys.front()};
    if (after == move.keys.end()) return {move.keys.back()};
    return between(move, std::size_t(after - move.keys.begin()) - 1,
                   (time - after[-1].time) / (after[0].time - after[-1].time));
}

}  // namespace

Placement placementAt(const Velocity& move, double time)
{
    return {Mat3::Identity(), Vec3::Zero(), time * move.velocity};
}

Placement placementAt(const Keys& move, double time)
{
    const PoseKey pose = movingAt(move, time).pose;
    return {rotationOf(pose.rotate), move.pivot, pose.translate};
}

Placement placementAt(const Path& path, double time)
{
    return std::visit([&](const auto& move) { return placementAt(move, time); }, path);
}

RigidVelocity velocityAt(const Velocity& move, double) { return {.velocity = move.velocity}; }

RigidVelocity velocityAt(const Keys& move, double time)
{
    const Moving now = movingAt(move, time);
    const Vec3 rate = std::numbers::pi / 180 * now.rotate;
    // Turned about x first: that axis goes along with the turns about y and z, that of y with the one about z.
    const Mat3 y = rotationOf({0, now.pose.rotate.y(), 0}), z = rotationOf({0, 0, now.pose.rotate.z()});
    const Vec3 spin = rate.z() * Vec3::UnitZ() + z * (rate.y() * Vec3::UnitY() + y * (rate.x() * Vec3::UnitX()));
    return {now.translate, spin, move.pivot + now.pose.translate};
}

RigidVelocity velocityAt(const Path& path, double time)
{
    return std::visit([&](const auto& move) { return velocityAt(move, time); }, path);
}

}  // namespace vdbfrac::scene
