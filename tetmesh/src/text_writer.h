// Text and bytes in one growing buffer, the same in every locale. Not installed.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace vdbfrac::tetmesh {

class TextWriter {
public:
    /// `digits`: significant ones of a number; 0 for as many as tell it from all others.
    explicit TextWriter(int digits = 0) : digits_(digits) {}

    TextWriter& operator<<(std::string_view s)
    {
        text_ += s;
        return *this;
    }
    TextWriter& operator<<(double v)
    {
        if (digits_ > 0 && appendFixed(v)) return *this;
        char digits[kLongestNumber];
        constexpr auto kForm = std::chars_format::general;
        text_.append(digits, digits_ > 0 ? std::to_chars(digits, digits + kLongestNumber, v, kForm, digits_).ptr
                                         : std::to_chars(digits, digits + kLongestNumber, v).ptr);
        return *this;
    }
    TextWriter& operator<<(std::integral auto v)
    {
        char digits[kLongestNumber];
        text_.append(digits, std::to_chars(digits, digits + kLongestNumber, v).ptr);
        return *this;
    }
    /// Numbers with blanks between them, then a newline.
    template <class First, class... Rest>
    void line(const First& first, const Rest&... rest)
    {
        *this << first;
        ((*this << " " << rest), ...);
        text_ += '\n';
    }

    /// The bytes of a value.
    template <std::endian order, class T>
    void bytes(T value)
    {
        char raw[sizeof(T)];
        const auto from = std::bit_cast<std::array<char, sizeof(T)>>(value);
        for (std::size_t i = 0; i < sizeof(T); ++i) raw[i] = from[order == std::endian::native ? i : sizeof(T) - 1 - i];
        text_.append(raw, sizeof(T));
    }
    void reserve(std::size_t bytes) { text_.reserve(bytes); }
    const std::string& text() const { return text_; }

private:
    static constexpr std::size_t kLongestNumber = 32;
    static constexpr std::array<double, 14> kPowers = {1e0, 1e1, 1e2, 1e3,  1e4,  1e5,  1e6,
                                                       1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13};

    /// What to_chars writes, twice as fast. False, and nothing, for what it writes with an exponent, and where the
    /// rounding of a product could decide the last digit.
    bool appendFixed(double v)
    {
        constexpr int kMostDigits = 9;   // products are off by no more than 1e-7 of the last digit
        constexpr double kClear = 1e-6;  // of the last digit
        constexpr double kLeast = 1e-4;
        const double size = std::abs(v);
        if (digits_ > kMostDigits || !(size >= kLeast) || size >= kPowers[std::size_t(digits_)]) return false;
        int exponent = 0;
        while (size >= kPowers[std::size_t(exponent + 1)]) ++exponent;
        for (double below = size; below < 1; below *= 10) --exponent;
        const double scaled = size * kPowers[std::size_t(digits_ - 1 - exponent)];
        const std::int32_t whole = std::int32_t(scaled);  // below 1e9
        const double rest = scaled - whole;
        if (std::abs(rest - .5) < kClear) return false;
        const std::int32_t number = whole + (rest > .5);
        if (number >= std::int32_t(kPowers[std::size_t(digits_)])) return false;
        char digits[kLongestNumber], text[kLongestNumber], *end = text;
        std::to_chars(digits, digits + kLongestNumber, number);
        int used = digits_;
        while (used > 1 && digits[used - 1] == '0') --used;
        const int before = std::max(0, exponent + 1);
        if (v < 0) *end++ = '-';
        if (before == 0) end = std::copy_n("0.000", 1 - exponent, end);
        end = std::copy_n(digits, before, end);
        if (before > 0 && used > before) *end++ = '.';
        end = std::copy(digits + before, digits + std::max(before, used), end);
        text_.append(text, end);
        return true;
    }

    int digits_;
    std::string text_;
};

}  // namespace vdbfrac::tetmesh
