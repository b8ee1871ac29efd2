#include <vdbfrac/base/error.h>

namespace vdbfrac {

namespace {

std::string text(const std::vector<InputError::Detail>& details)
{
    std::string all;
    for (const InputError::Detail& d : details) {
        if (!all.empty()) all += '\n';
        all += d.place + ": " + d.what;
        if (!d.allowed.empty()) all += "\n    allowed: " + d.allowed;
        if (!d.hint.empty()) all += "\n    hint: " + d.hint;
    }
    return all;
}

}  // namespace

InputError::InputError(std::vector<Detail> details) : Error(text(details)), details_(std::move(details)) {}

}  // namespace vdbfrac
