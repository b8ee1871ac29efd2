// Text and bytes in one growing buffer, the same in every locale. Not installed.
#pragma once

#include <array>
#include <bit>
#include <charconv>
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
    int digits_;
    std::string text_;
};

}  // namespace vdbfrac::tetmesh
