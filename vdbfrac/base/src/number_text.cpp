#include <vdbfrac/base/number_text.h>

#include <charconv>

namespace vdbfrac {

std::string shortNumber(double value, int digits)
{
    char text[64];
    return {text, std::to_chars(text, text + sizeof text, value, std::chars_format::general, digits).ptr};
}

std::optional<double> numberFrom(std::string_view text)
{
    double value = 0;
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    return error == std::errc() && stop == end ? std::optional(value) : std::nullopt;
}

std::string csvCell(const std::string& text)
{
    if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
    std::string cell = "\"";
    for (const char c : text) cell.append(c == '"' ? 2 : 1, c);
    return cell + '"';
}

std::vector<std::string> csvCells(const std::string& line)
{
    std::vector<std::string> cells(1);
    bool isQuoted = false;
    for (std::size_t i = 0; i < line.size(); ++i) {
        const bool isQuote = line[i] == '"', isTwice = isQuoted && isQuote && line.compare(i, 2, "\"\"") == 0;
        if (isQuote && !isTwice)
            isQuoted = !isQuoted;
        else if (line[i] == ',' && !isQuoted)
            cells.emplace_back();
        else
            cells.back() += line[i];
        i += isTwice;
    }
    return cells;
}

std::string rangeText(long long first, long long last)
{
    return std::to_string(first) + (last > first ? "-" + std::to_string(last) : "");
}

}  // namespace vdbfrac
