// Pictures as .png files.
#pragma once

#include <vdbfrac/pictures/render.h>

#include <filesystem>
#include <string>
#include <vector>

namespace vdbfrac::pictures {

/// The bytes of a .png file of a picture, with 8 bits of each colour. Throws Error for a picture without pixels.
std::string pngOf(const Image& image);
/// Writes it atomically. Throws FileError.
void writePng(const std::filesystem::path& file, const Image& image);

/// Reads a picture as 8-bit RGB; transparency is laid over black. Throws FileError.
Image readPng(const std::filesystem::path& file);

/// Each pixel the mean of `factor` x `factor` of them; what is left over at the right and below is cut off. Of the
/// light that a screen shows.
Image reduced(const Image& image, int factor);

/// Places pictures side by side, `columns` in a row, `gap` white pixels between and around them. Each cell is as
/// large as the largest picture, which smaller ones share with white. No pictures make an empty image.
Image contactSheet(const std::vector<Image>& images, int columns, int gap);

}  // namespace vdbfrac::pictures
