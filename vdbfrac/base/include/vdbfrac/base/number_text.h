// Numbers as people write them, whatever the locale of the program, and tables of them.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace vdbfrac {

/// With so many digits that count: "0.05", "1.2e-07".
std::string shortNumber(double value, int digits = 6);

/// The number that is all of a text; none for other texts.
std::optional<double> numberFrom(std::string_view text);

/// "1 frame", "2 frames".
template <class Number>
std::string counted(Number count, const std::string& noun)
{
    return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

/// As a cell of a table in CSV (RFC 4180): in quotes where it has commas, quotes or line ends.
std::string csvCell(const std::string& text);
/// The cells of a line of such a table.
std::vector<std::string> csvCells(const std::string& line);

/// "5", or "5-8".
std::string rangeText(long long first, long long last);

/// "1-3, 5" of rising whole numbers; `between` the ranges.
template <class Number>
std::string rangesText(const std::vector<Number>& numbers, const char* between)
{
    std::string text;
    for (std::size_t i = 0, last; i < numbers.size(); i = last + 1) {
        last = i;
        while (last + 1 < numbers.size() && numbers[last + 1] == numbers[last] + 1) ++last;
        text += (i > 0 ? between : "") + rangeText((long long)numbers[i], (long long)numbers[last]);
    }
    return text;
}

}  // namespace vdbfrac
