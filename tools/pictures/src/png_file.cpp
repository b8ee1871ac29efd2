#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/pictures/png_file.h>

#include <png.h>

#include <algorithm>
#include <cstring>

namespace vdbfrac::pictures {

namespace {

/// libpng's plain interface, ended whatever happens.
class PngImage {
public:
    PngImage()
    {
        std::memset(&image, 0, sizeof(image));
        image.version = PNG_IMAGE_VERSION;
    }
    ~PngImage() { png_image_free(&image); }
    PngImage(const PngImage&) = delete;
    PngImage& operator=(const PngImage&) = delete;

    png_image image;
};

Image decode(const std::string& bytes, const std::string& file)
{
    PngImage png;
    if (!png_image_begin_read_from_memory(&png.image, bytes.data(), bytes.size()))
        throw FileError(file, std::string("is not a picture: ") + png.image.message);
    png.image.format = PNG_FORMAT_RGB;
    Image image{int(png.image.width), int(png.image.height), {}};
    image.rgb.resize(PNG_IMAGE_SIZE(png.image));
    const png_color black{0, 0, 0};
    if (!png_image_finish_read(&png.image, &black, image.rgb.data(), 0, nullptr))
        throw FileError(file, std::string("is damaged: ") + png.image.message);
    return image;
}

}  // namespace

std::string pngOf(const Image& image)
{
    const std::size_t pixels = std::size_t(std::max(image.width, 0)) * std::size_t(std::max(image.height, 0));
    if (pixels == 0 || image.rgb.size() != 3 * pixels)
        throw Error("a picture of " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                    " pixels cannot be written");
    PngImage png;
    png.image.width = png_uint_32(image.width);
    png.image.height = png_uint_32(image.height);
    png.image.format = PNG_FORMAT_RGB;
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png.image);
    std::string bytes(size, '\0');
    if (!png_image_write_to_memory(&png.image, bytes.data(), &size, 0, image.rgb.data(), 0, nullptr))
        throw Error(std::string("a picture cannot be encoded: ") + png.image.message);
    bytes.resize(size);
    return bytes;
}

void writePng(const std::filesystem::path& file, const Image& image)
{
    std::string bytes;
    try {
        bytes = pngOf(image);
    } catch (const Error& e) {
        throw FileError(file.string(), e.what());
    }
    writeText(file, bytes);
}

Image readPng(const std::filesystem::path& file) { return decode(readText(file), file.string()); }

Image reduced(const Image& image, int factor)
{
    if (factor <= 1) return image;
    Image small{image.width / factor, image.height / factor, {}};
    small.rgb.reserve(3 * std::size_t(small.width) * std::size_t(small.height));
    for (int y = 0; y < small.height; ++y)
        for (int x = 0; x < small.width; ++x)
            for (int k = 0; k < 3; ++k) {
                int sum = 0;
                for (int j = 0; j < factor; ++j)
                    for (int i = 0; i < factor; ++i)
                        sum += image.rgb[std::size_t(3 * ((y * factor + j) * image.width + x * factor + i) + k)];
                small.rgb.push_back(std::uint8_t((sum + factor * factor / 2) / (factor * factor)));
            }
    return small;
}

Image contactSheet(const std::vector<Image>& images, int columns, int gap)
{
    if (images.empty()) return {};
    columns = std::clamp(columns, 1, int(images.size()));
    gap = std::max(gap, 0);
    int width = 0, height = 0;
    for (const Image& image : images) {
        width = std::max(width, image.width);
        height = std::max(height, image.height);
    }
    const int rows = (int(images.size()) + columns - 1) / columns;
    Image sheet{columns * (width + gap) + gap, rows * (height + gap) + gap, {}};
    sheet.rgb.assign(3 * std::size_t(sheet.width) * std::size_t(sheet.height), 255);
    for (std::size_t n = 0; n < images.size(); ++n) {
        const int left = gap + int(n) % columns * (width + gap), top = gap + int(n) / columns * (height + gap);
        const std::size_t bytes = 3 * std::size_t(images[n].width);
        for (int j = 0; j < images[n].height; ++j)
            std::copy_n(images[n].rgb.data() + std::size_t(j) * bytes, bytes,
                        sheet.rgb.data() + 3 * (std::size_t(top + j) * std::size_t(sheet.width) + std::size_t(left)));
    }
    return sheet;
}

}  // namespace vdbfrac::pictures
