// Light as screens have it (sRGB). Not installed.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace vdbfrac::pictures {

/// A light value as a byte of sRGB.
inline std::uint8_t byteOf(float linear)
{
    const float v = std::clamp(linear, 0.f, 1.f);
    const float s = v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1 / 2.4f) - 0.055f;
    return std::uint8_t(s * 255 + 0.5f);
}

inline float linearOf(std::uint32_t byte)
{
    const float s = float(byte) / 255;
    return s <= 0.04045f ? s / 12.92f : std::pow((s + 0.055f) / 1.055f, 2.4f);
}

}  // namespace vdbfrac::pictures
