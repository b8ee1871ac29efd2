// Pieces of TOML.
#pragma once

#include <vdbfrac/base/vec.h>

#include <fmt/printf.h>

#include <string>

namespace vdbfrac::lab::verify {

/// As printf does.
template <class... Arguments>
std::string format(const char* pattern, const Arguments&... arguments)
{
    return fmt::sprintf(pattern, arguments...);
}

/// As a TOML array, with five digits.
// No -0.
inline std::string list(const Vec3& v) { return format("[%.5g, %.5g, %.5g]", v.x() + 0, v.y() + 0, v.z() + 0); }

}  // namespace vdbfrac::lab::verify
