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

PoseKey poseAt(const std::vector<PoseKey>& keys, double time)
{
    const auto after = keyAfter(keys, time);
    if (after == keys.begin()) return keys.front();
    if (after == keys.end()) return keys.back();
    const PoseKey &a = after[-1], &b = after[0];
    const double s = (time - a.time) / (b.time - a.time);
    return {time, (1 - s) * a.translate + s * b.translate, (1 - s) * a.rotate + s * b.rotate};
}

}  // namespace

Placement placementAt(const Velocity& move, double time)
{
    return {Mat3::Identity(), Vec3::Zero(), time * move.velocity};
}

Placement placementAt(const Keys& move, double time)
{
    const PoseKey pose = poseAt(move.keys, time);
    return {rotationOf(pose.rotate), move.pivot, pose.translate};
}

Placement placementAt(const Path& path, double time)
{
    return std::visit([&](const auto& move) { return placementAt(move, time); }, path);
}

RigidVelocity velocityAt(const Velocity& move, double) { return {.velocity = move.velocity}; }

RigidVelocity velocityAt(const Keys& move, double time)
{
    const auto after = keyAfter(move.keys, time);
    if (after == move.keys.begin() || after == move.keys.end()) return {};
    const PoseKey &a = after[-1], &b = after[0], now = poseAt(move.keys, time);
    const double perSecond = 1 / (b.time - a.time);
    const Vec3 rate = perSecond * (std::numbers::pi / 180) * (b.rotate - a.rotate);
    // Turned about x first: that axis goes along with the turns about y and z, that of y with the one about z.
    const Mat3 y = rotationOf({0, now.rotate.y(), 0}), z = rotationOf({0, 0, now.rotate.z()});
    const Vec3 spin = rate.z() * Vec3::UnitZ() + z * (rate.y() * Vec3::UnitY() + y * (rate.x() * Vec3::UnitX()));
    return {perSecond * (b.translate - a.translate), spin, move.pivot + now.translate};
}

RigidVelocity velocityAt(const Path& path, double time)
{
    return std::visit([&](const auto& move) { return velocityAt(move, time); }, path);
}

}  // namespace vdbfrac::scene
