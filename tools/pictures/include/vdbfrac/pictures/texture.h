// Pictures that lie on surfaces.
#pragma once

#include <vdbfrac/pictures/render.h>

#include <filesystem>
#include <string>
#include <vector>

namespace vdbfrac::pictures {

/// The linear colour of a texture at (u, v), between its pixels: u to the right, v upwards, (0, 0) its lower left
/// corner, (1, 1) the upper right one. It repeats. Of one without pixels: white.
Colour textureColour(const Image& texture, double u, double v);

/// Textures of a material library, and what had to be left out.
struct ReadTextures {
    MaterialTextures textures;
    std::vector<std::string> notes;  ///< one for each file that cannot be read: which, why, and what is drawn instead
};
/// Reads the textures of diffuse colours (map_Kd) that are .png files, each once. `mtl` is the text of the library,
/// `folder` what names in it are relative to.
ReadTextures readTextures(const std::string& mtl, const std::filesystem::path& folder);

}  // namespace vdbfrac::pictures
