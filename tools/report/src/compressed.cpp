#include "compressed.h"

#include <vdbfrac/base/error.h>

#include <zlib.h>

namespace vdbfrac::report {

Bytes compressed(std::span<const std::uint8_t> bytes)
{
    constexpr int kLevel = 6;
    uLongf size = compressBound(uLong(bytes.size()));
    Bytes packed(size);
    if (compress2(packed.data(), &size, bytes.data(), uLong(bytes.size()), kLevel) != Z_OK)
        throw Error("zlib: cannot pack a frame");
    packed.resize(size);
    return packed;
}

std::string base64(std::span<const std::uint8_t> bytes)
{
    constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t three = 0;
        for (std::size_t k = 0; k < 3; ++k) three = three << 8 | (i + k < bytes.size() ? bytes[i + k] : 0u);
        for (std::size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? kDigits[three >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

}  // namespace vdbfrac::report
