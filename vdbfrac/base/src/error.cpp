#include <vdbfrac/base/error.h>

#include <algorithm>
#include <span>

namespace vdbfrac {

namespace {

std::string text(const std::vector<InputError::Detail>& details)
{
    constexpr std::size_t kMost = 20;  // one mistake in a script that writes scenes repeats in every table
    std::string all;
    for (const InputError::Detail& d : std::span(details).first(std::min(details.size(), kMost))) {
        if (!all.empty()) all += '\n';
        all += d.place + ": " + d.what;
        if (!d.allowed.empty()) all += "\n    allowed: " + d.allowed;
        if (!d.hint.empty()) all += "\n    hint: " + d.hint;
    }
    if (details.size() > kMost) all += "\nand " + std::to_string(details.size() - kMost) + " more";
    return all;
}

}  // namespace

InputError::InputError(std::vector<Detail> details) : Error(text(details)), details_(std::move(details)) {}

}  // namespace vdbfrac
