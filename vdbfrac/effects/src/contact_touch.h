// What touches what. Not installed.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/contact/contact_law.h>

#include <array>
#include <cstdint>

namespace vdbfrac::effects {

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

}  // namespace vdbfrac::effects
