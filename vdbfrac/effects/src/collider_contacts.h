// What colliders know of samples in a step.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/contact/contact_law.h>

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace vdbfrac::effects {

/// Where a sample is as a stage of a step begins, in the frame of a collider at t = 0, and how far from there it
/// touches nothing.
struct Apart {
    Vec3 at;
    Vec3 anchor;                    ///< where it was as the step began: from there it slips
    double distance = 0, room = 0;  ///< m; no room, or less: it may touch at once

    bool isSafe(const Vec3& X) const { return room > 0 && (X - at).squaredNorm() < room * room; }
};

/// A sample in a collider, or a point of a stretched edge.
struct ColliderContact {
    std::uint32_t sample = 0, collider = 0;
    double depth = 0;  ///< beyond its allowance [m]
    Vec3 outward;      ///< gradient of the distance
};

/// How a collider pushes a sample.
struct ColliderPush {
    std::uint32_t sample = 0, collider = 0;
    Vec3 force;  ///< N
};

/// One for each sample and collider, by rising ones.
inline std::vector<ColliderPush> merged(std::vector<ColliderPush> all)
{
    const auto place = [](const ColliderPush& p) { return std::pair(p.sample, p.collider); };
    std::ranges::stable_sort(all, {}, place);
    std::size_t count = 0;
    for (const ColliderPush& p : all)
        if (count > 0 && place(all[count - 1]) == place(p))
            all[count - 1].force += p.force;
        else
            all[count++] = p;
    all.resize(count);
    return all;
}

/// The strongest touch of a sample.
struct ColliderFriction {
    std::uint32_t sample = 0, collider = 0;
    contact::FrictionSpring spring;
    mutable contact::Dual dual = spring.dual();
};

}  // namespace vdbfrac::effects
