// A double that is beyond all others.
#pragma once

#include <limits>

namespace vdbfrac {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace vdbfrac
