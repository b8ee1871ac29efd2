// Bytes as text in a page.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace vdbfrac::report {

using Bytes = std::vector<std::uint8_t>;

/// A zlib stream. Throws Error.
Bytes compressed(std::span<const std::uint8_t> bytes);

/// RFC 4648, section 4.
std::string base64(std::span<const std::uint8_t> bytes);

/// Appends the bytes of each value, all lowest ones first: neighbours that are alike are packed better.
template <class T>
void addPlanes(std::span<const T> values, Bytes& bytes)
{
    for (std::size_t plane = 0; plane < sizeof(T); ++plane)
        for (const T v : values) bytes.push_back(std::uint8_t(v >> (8 * plane)));
}

}  // namespace vdbfrac::report
