#include <vdbfrac/scene/placement.h>

#include <algorithm>

namespace vdbfrac::scene {

namespace {

PoseKey poseAt(const std::vector<PoseKey>& keys, double time)
{
    const auto after =
        std::upper_bound(keys.begin(), keys.end(), time, [](double t, const PoseKey& k) { return t < k.time; });
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

}  // namespace vdbfrac::scene
