// Values as colours, and what the colours mean.
#include <vdbfrac/pictures/render.h>

#include "screen.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>

#include <algorithm>
#include <cctype>
#include <cmath>

namespace vdbfrac::pictures {

namespace {

struct Glyph {
    char character;
    std::uint8_t row[7];  // 5 bits each, from the top
};
constexpr Glyph kGlyphs[] = {
    {'0', {0x0e, 0x11, 0x13, 0x15, 0x19, 0x11, 0x0e}}, {'1', {0x04, 0x0c, 0x04, 0x04, 0x04, 0x04, 0x0e}},
    {'2', {0x0e, 0x11, 0x01, 0x06, 0x08, 0x10, 0x1f}}, {'3', {0x0e, 0x11, 0x01, 0x06, 0x01, 0x11, 0x0e}},
    {'4', {0x02, 0x06, 0x0a, 0x12, 0x1f, 0x02, 0x02}}, {'5', {0x1f, 0x10, 0x1e, 0x01, 0x01, 0x11, 0x0e}},
    {'6', {0x06, 0x08, 0x10, 0x1e, 0x11, 0x11, 0x0e}}, {'7', {0x1f, 0x01, 0x02, 0x04, 0x08, 0x08, 0x08}},
    {'8', {0x0e, 0x11, 0x11, 0x0e, 0x11, 0x11, 0x0e}}, {'9', {0x0e, 0x11, 0x11, 0x0f, 0x01, 0x02, 0x0c}},
    {'a', {0x00, 0x00, 0x0e, 0x01, 0x0f, 0x11, 0x0f}}, {'b', {0x10, 0x10, 0x1e, 0x11, 0x11, 0x11, 0x1e}},
    {'c', {0x00, 0x00, 0x0e, 0x10, 0x10, 0x11, 0x0e}}, {'d', {0x01, 0x01, 0x0f, 0x11, 0x11, 0x11, 0x0f}},
    {'e', {0x00, 0x00, 0x0e, 0x11, 0x1f, 0x10, 0x0e}}, {'f', {0x06, 0x09, 0x08, 0x1c, 0x08, 0x08, 0x08}},
    {'g', {0x00, 0x0f, 0x11, 0x11, 0x0f, 0x01, 0x0e}}, {'h', {0x10, 0x10, 0x16, 0x19, 0x11, 0x11, 0x11}},
    {'i', {0x04, 0x00, 0x0c, 0x04, 0x04, 0x04, 0x0e}}, {'j', {0x02, 0x00, 0x06, 0x02, 0x02, 0x12, 0x0c}},
    {'k', {0x10, 0x10, 0x12, 0x14, 0x18, 0x14, 0x12}}, {'l', {0x0c, 0x04, 0x04, 0x04, 0x04, 0x04, 0x0e}},
    {'m', {0x00, 0x00, 0x1a, 0x15, 0x15, 0x11, 0x11}}, {'n', {0x00, 0x00, 0x16, 0x19, 0x11, 0x11, 0x11}},
    {'o', {0x00, 0x00, 0x0e, 0x11, 0x11, 0x11, 0x0e}}, {'p', {0x00, 0x00, 0x1e, 0x11, 0x1e, 0x10, 0x10}},
    {'q', {0x00, 0x00, 0x0d, 0x13, 0x0f, 0x01, 0x01}}, {'r', {0x00, 0x00, 0x16, 0x19, 0x10, 0x10, 0x10}},
    {'s', {0x00, 0x00, 0x0e, 0x10, 0x0e, 0x01, 0x1e}}, {'t', {0x08, 0x08, 0x1c, 0x08, 0x08, 0x09, 0x06}},
    {'u', {0x00, 0x00, 0x11, 0x11, 0x11, 0x13, 0x0d}}, {'v', {0x00, 0x00, 0x11, 0x11, 0x11, 0x0a, 0x04}},
    {'w', {0x00, 0x00, 0x11, 0x11, 0x15, 0x15, 0x0a}}, {'x', {0x00, 0x00, 0x11, 0x0a, 0x04, 0x0a, 0x11}},
    {'y', {0x00, 0x00, 0x11, 0x11, 0x0f, 0x01, 0x0e}}, {'z', {0x00, 0x00, 0x1f, 0x02, 0x04, 0x08, 0x1f}},
    {'J', {0x07, 0x02, 0x02, 0x02, 0x02, 0x12, 0x0c}}, {'.', {0x00, 0x00, 0x00, 0x00, 0x00, 0x0c, 0x0c}},
    {'+', {0x00, 0x04, 0x04, 0x1f, 0x04, 0x04, 0x00}}, {'-', {0x00, 0x00, 0x00, 0x1f, 0x00, 0x00, 0x00}},
    {'/', {0x01, 0x01, 0x02, 0x04, 0x08, 0x10, 0x10}}, {'^', {0x04, 0x0a, 0x11, 0x00, 0x00, 0x00, 0x00}},
    {'(', {0x02, 0x04, 0x08, 0x08, 0x08, 0x04, 0x02}}, {')', {0x08, 0x04, 0x02, 0x02, 0x02, 0x04, 0x08}},
    {'=', {0x00, 0x00, 0x1f, 0x00, 0x1f, 0x00, 0x00}}, {'_', {0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x1f}},
    {',', {0x00, 0x00, 0x00, 0x00, 0x0c, 0x04, 0x08}}, {':', {0x00, 0x0c, 0x0c, 0x00, 0x0c, 0x0c, 0x00}},
    {'[', {0x0e, 0x08, 0x08, 0x08, 0x08, 0x08, 0x0e}}, {']', {0x0e, 0x02, 0x02, 0x02, 0x02, 0x02, 0x0e}},
};
constexpr int kWide = 5, kTall = 7, kStep = 6;  // of a glyph, and from one to the next

using Pixel = std::array<std::uint8_t, 3>;

struct Canvas {
    Image& image;
    int scale;  // pixels of a dot

    void fill(int x, int y, int width, int height, const Pixel& pixel)
    {
        for (int j = std::max(0, y); j < std::min(image.height, y + height); ++j)
            for (int i = std::max(0, x); i < std::min(image.width, x + width); ++i)
                std::copy(pixel.begin(), pixel.end(),
                          &image.rgb[3 * (std::size_t(j) * std::size_t(image.width) + std::size_t(i))]);
    }
    void write(int x, int y, const std::string& text, const Pixel& pixel)
    {
        for (const char c : text) {
            const auto glyph =
                std::find_if(std::begin(kGlyphs), std::end(kGlyphs), [&](const Glyph& g) { return g.character == c; });
            for (int j = 0; glyph != std::end(kGlyphs) && j < kTall; ++j)
                for (int i = 0; i < kWide; ++i)
                    if (glyph->row[j] >> (kWide - 1 - i) & 1) fill(x + scale * i, y + scale * j, scale, scale, pixel);
            x += kStep * scale;
        }
    }
    int widthOf(const std::string& text) const { return kStep * scale * int(text.size()); }
};

Pixel pixelOf(const Colour& linear) { return {byteOf(linear[0]), byteOf(linear[1]), byteOf(linear[2])}; }

/// Where a value stands between the ends of a scale.
double shareOf(double value, const Scale& scale)
{
    if (!(scale.high > scale.low)) return 0;
    const double share = std::clamp((value - scale.low) / (scale.high - scale.low), 0., 1.);
    return scale.byRoot ? std::sqrt(share) : share;
}

}  // namespace

Colour colourOnScreen(std::uint32_t rgb)
{
    return {linearOf(rgb >> 16 & 255), linearOf(rgb >> 8 & 255), linearOf(rgb & 255)};
}

Colour rampColour(double t)
{
    constexpr std::uint32_t kStops[] = {0x0d0887, 0x6a00a8, 0xb12a90,
                                        0xe16462, 0xfca636, 0xf0f921};  // as pages have them
    constexpr int kLast = int(std::size(kStops)) - 1;
    const double at = std::clamp(t, 0., 1.) * kLast;
    const int low = std::min(int(at), kLast - 1);
    const float share = float(at - low);
    return (1 - share) * colourOnScreen(kStops[low]) + share * colourOnScreen(kStops[low + 1]);
}

void colourByValue(Subject& subject, std::span<const float> ofPoints, const Scale& scale)
{
    if (ofPoints.size() != subject.points.size()) throw Error("a surface with other points than it has values");
    const Colour none = colourOnScreen(0x8a8a86);
    subject.cornerColour.clear(), subject.textured.clear();
    for (const auto& t : subject.triangles) {
        auto& corners = subject.cornerColour.emplace_back();
        for (std::size_t k = 0; k < 3; ++k) {
            const double value = double(ofPoints[t[k]]);
            corners[k] = value < 0 ? none : rampColour(shareOf(value, scale));
        }
    }
}

void drawLegend(Image& image, const Scale& scale, const std::string& what)
{
    constexpr int kSmallest = 300;  // pixels that letters of one pixel a dot suit
    Canvas canvas{image, std::max(1, image.width / kSmallest)};
    const int dot = canvas.scale, margin = 8 * dot, length = image.width / 3, bar = 8 * dot;
    const int top = image.height - margin - bar - (kTall + 4) * dot;
    const Pixel ink{30, 31, 33};
    for (int i = 0; i < length; ++i) {
        const double value = scale.low + (i + 0.5) * (scale.high - scale.low) / length;
        canvas.fill(margin + i, top, 1, bar, pixelOf(rampColour(shareOf(value, scale))));
    }
    const std::string high = shortNumber(scale.high, 3);
    const int below = top + bar + 4 * dot;
    canvas.write(margin, below, shortNumber(scale.low, 3), ink);
    canvas.write(margin + length - canvas.widthOf(high), below, high, ink);
    canvas.write(margin, top - (kTall + 4) * dot, what, ink);
}

void drawLabel(Image& image, const std::string& text)
{
    constexpr int kAcross = 240, kMargin = 3;  // pixels of a picture for each pixel of a dot; dots
    Canvas canvas{image, std::max(1, image.width / kAcross)};
    std::string small;
    for (const char c : text) small += char(std::tolower(static_cast<unsigned char>(c)));
    const int margin = kMargin * canvas.scale;
    canvas.fill(0, 0, canvas.widthOf(small) + 2 * margin, kTall * canvas.scale + 2 * margin, {40, 40, 40});
    canvas.write(margin, margin, small, {235, 235, 235});
}

}  // namespace vdbfrac::pictures
