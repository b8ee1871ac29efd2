// Pieces of TOML.
#pragma once

#include <vdbfrac/base/vec.h>

#include <cstdarg>
#include <cstdio>
#include <string>

namespace vdbfrac::lab::verify {

/// As printf does.
[[gnu::format(printf, 1, 2)]] inline std::string format(const char* pattern, ...)
{
    char text[512];
    va_list arguments;
    va_start(arguments, pattern);
    std::vsnprintf(text, sizeof text, pattern, arguments);
    va_end(arguments);
    return text;
}

/// As a TOML array, with five digits.
// No -0.
inline std::string list(const Vec3& v) { return format("[%.5g, %.5g, %.5g]", v.x() + 0, v.y() + 0, v.z() + 0); }

}  // namespace vdbfrac::lab::verify
