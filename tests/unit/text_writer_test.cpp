// Numbers as text: what std::to_chars writes, which is slower.
#include "text_writer.h"

#include <gtest/gtest.h>

#include <charconv>
#include <cmath>
#include <limits>
#include <random>
#include <string>

namespace vdbfrac::tetmesh {
namespace {

std::string byToChars(double v, int digits)
{
    char text[64];
    return {text, std::to_chars(text, text + sizeof text, v, std::chars_format::general, digits).ptr};
}

TEST(TextWriter, WritesNumbersAsToCharsDoes)
{
    constexpr double kUlp = std::numeric_limits<double>::epsilon();
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> size(-7, 12), part(-1, 1);
    const auto expectSame = [&](double v) {
        for (const int digits : {6, 9, 12}) {
            TextWriter text(digits);
            text << v;
            ASSERT_EQ(text.text(), byToChars(v, digits)) << digits << " digits";
        }
    };
    for (const double v : {0., -0., 1., -1., .1, 1e-4, 9.9999e-5, 123456789., 1e300, 5e-324}) expectSame(v);
    for (int i = 0; i < 200'000; ++i) {
        const double v = part(random) * std::pow(10, size(random));
        expectSame(v);
        expectSame(double(float(v)));
        expectSame(std::round(v * 1e4) / 1e4);                    // few digits
        expectSame((std::floor(std::abs(v) * 1e3) + .5) / 1e12);  // next to a tie of nine digits
        expectSame(std::pow(10, std::floor(size(random))) * (1 + (int(random() % 5) - 2) * kUlp));
    }
}

}  // namespace
}  // namespace vdbfrac::tetmesh
