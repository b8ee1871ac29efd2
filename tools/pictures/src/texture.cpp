#include <vdbfrac/pictures/texture.h>

#include "screen.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/pictures/png_file.h>
#include <vdbfrac/tetmesh/mtl_file.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace vdbfrac::pictures {

namespace {

/// Light of all bytes: three powers for each pixel that a ray sees would take longer than the ray.
const std::array<float, 256>& lightOfBytes()
{
    static const std::array<float, 256> light = [] {
        std::array<float, 256> all{};
        for (std::uint32_t byte = 0; byte < all.size(); ++byte) all[byte] = linearOf(byte);
        return all;
    }();
    return light;
}

/// Two neighbouring pixels of a row or column that repeats, and where a place is between their middles.
struct Between {
    std::size_t low = 0, high = 0;
    float share = 0;  // 0 at low, 1 at high

    Between(double at, int pixels)
    {
        const double whole = std::isfinite(at) ? at - std::floor(at) : 0, place = whole * pixels - 0.5;
        const double below = std::floor(place);
        share = float(place - below);
        low = std::size_t((int(below) + pixels) % pixels), high = (low + 1) % std::size_t(pixels);
    }
};

/// A texture, or none and a note why.
std::shared_ptr<const Image> textureIn(const std::filesystem::path& file, std::vector<std::string>& notes)
{
    constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";
    const std::string without = "; its materials are drawn without it";
    try {
        if (!readText(file).starts_with(kSignature))
            notes.push_back("texture " + file.string() + ": is not a .png file, which textures have to be" + without);
        else
            return std::make_shared<const Image>(readPng(file));
    } catch (const FileError& e) {
        notes.push_back(std::string("texture ") + e.what() + without);
    }
    return nullptr;
}

}  // namespace

Colour textureColour(const Image& texture, double u, double v)
{
    if (texture.width < 1 || texture.height < 1) return Colour::Ones();
    const Between across(u, texture.width), down(1 - v, texture.height);
    const auto& light = lightOfBytes();
    const auto at = [&](std::size_t i, std::size_t j) {
        const std::uint8_t* rgb = &texture.rgb[3 * (j * std::size_t(texture.width) + i)];
        return Colour(light[rgb[0]], light[rgb[1]], light[rgb[2]]);
    };
    const auto row = [&](std::size_t j) {
        return Colour((1 - across.share) * at(across.low, j) + across.share * at(across.high, j));
    };
    return (1 - down.share) * row(down.low) + down.share * row(down.high);
}

ReadTextures readTextures(const std::string& mtl, const std::filesystem::path& folder)
{
    ReadTextures read;
    std::map<std::filesystem::path, std::shared_ptr<const Image>> images;
    for (const auto& [material, map] : tetmesh::diffuseMaps(mtl)) {
        const auto [image, isNew] = images.try_emplace(folder / map.file);
        if (isNew) image->second = textureIn(image->first, read.notes);
        if (image->second) read.textures[material] = {image->second, map.scale.cast<float>(), map.offset.cast<float>()};
    }
    return read;
}

}  // namespace vdbfrac::pictures
