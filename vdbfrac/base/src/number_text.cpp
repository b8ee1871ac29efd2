#include <vdbfrac/base/number_text.h>

#include <charconv>

namespace vdbfrac {

std::string shortNumber(double value, int digits)
{
    char text[64];
    return {text, std::to_chars(text, text + sizeof text, value, std::chars_format::general, digits).ptr};
}

}  // namespace vdbfrac
