// What touches what, and what a scene says about it. Not installed.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/contact/contact_law.h>
#include <vdbfrac/scene/key.h>

#include <algorithm>
#include <array>
#include <limits>
#include <cstdint>
#include <span>

namespace vdbfrac::effects {

inline const scene::Key kContactKeys[] = {
    {"friction", scene::Type::number, "", "Coulomb's coefficient", "0.5", 0},
    {"stiffness", scene::Type::number, "", "of a touch, over that of a cell: E / h times this, for each metre of depth",
     "10", 0, std::numeric_limits<double>::infinity(), true},
    {"gap", scene::Type::number, "voxels",
     "that surfaces which touch keep; thin cut tets are crushed where it is large", "0", 0, 1},
    {"lips",
     scene::Type::choice,
     "",
     "where lips of a crack touch: where material is left, or closed, as they are drawn",
     "\"as_simulated\"",
     -std::numeric_limits<double>::infinity(),
     std::numeric_limits<double>::infinity(),
     false,
     false,
     {"as_simulated", "closed"}},
    {"untangle_speed", scene::Type::number, "m/s", "at which what was tangled when it was first seen is pushed apart",
     "0", 0},
};

/// A sample in a target.
struct Touch {
    std::uint32_t sample = 0, target = 0;
    double depth = 0;  ///< beyond its allowance [m]
    std::array<double, 4> share{};
    Vec3 outward;
};

/// The strongest touch of a sample.
struct Held {
    std::uint32_t sample = 0, target = 0;
    std::array<double, 4> share{};
    contact::Rub rub;
    Vec3 apart;  ///< m: from the point of the target to the sample, when the step began
    mutable contact::Dual dual = rub.dual();
};

// Voxels: what pieces may overlap by in the scenes that were measured, half of it, and how much deeper a step may end.
constexpr double kDeep = 0.2, kHidden = kDeep / 2, kJump = kDeep / 4;

/// Is a touch more than `deep` [m] deeper than those that were seen of its sample? Both by rising sample.
inline bool hidesDeep(std::span<const Touch> seen, std::span<const Touch> all, double deep)
{
    auto known = seen.begin();
    for (const Touch& t : all) {
        double depth = deep;
        while (known != seen.end() && known->sample < t.sample) ++known;
        for (auto k = known; k != seen.end() && k->sample == t.sample; ++k) depth = std::max(depth, k->depth + deep);
        if (t.depth > depth) return true;
    }
    return false;
}

}  // namespace vdbfrac::effects
