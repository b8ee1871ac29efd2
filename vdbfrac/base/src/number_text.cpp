#include <vdbfrac/base/number_text.h>

#include <charconv>

namespace vdbfrac {

std::string shortNumber(double value, int digits)
{
    char text[64];
    return {text, std::to_chars(text, text + sizeof text, value, std::chars_format::general, digits).ptr};
}

std::string rangeText(long long first, long long last)
{
    return std::to_string(first) + (last > first ? "-" + std::to_string(last) : "");
}

}  // namespace vdbfrac
