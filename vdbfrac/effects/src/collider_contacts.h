// What colliders know of samples in a step.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/contact/contact_law.h>

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace vdbfrac::effects {

/// A sample in a collider, or a point of a stretched edge.
struct ColliderContact {
    std::uint32_t sample = 0, collider = 0;
    double depth = 0;  ///< beyond its allowance [m]
    Vec3 outward;      ///< gradient of the distance
};

inline bool isBefore(const ColliderContact& a, const ColliderContact& b)
{
    return std::pair(a.sample, a.collider) < std::pair(b.sample, b.collider);
}

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
    Vec3 anchor;  ///< where it was as the step began, in the frame of the collider at t = 0: from there it slips [m]
    contact::FrictionSpring spring;
    mutable contact::Dual dual = spring.dual();
};

}  // namespace vdbfrac::effects
