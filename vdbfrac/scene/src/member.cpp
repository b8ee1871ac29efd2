#include <vdbfrac/scene/key.h>

#include <vdbfrac/base/error.h>

#include <algorithm>
#include <string>

namespace vdbfrac::scene {

const std::string& choiceName(const Key& key, long long value)
{
    const auto it =
        std::find_if(key.choices.begin(), key.choices.end(), [&](const Choice& c) { return c.value == value; });
    if (it == key.choices.end())
        throw InputError({key.name, std::to_string(value) + " is none of its choices", "", ""});
    return it->name;
}

std::optional<long long> choiceValue(const Key& key, const std::string& name)
{
    const auto it =
        std::find_if(key.choices.begin(), key.choices.end(), [&](const Choice& c) { return c.name == name; });
    return it == key.choices.end() ? std::nullopt : std::optional(it->value);
}

}  // namespace vdbfrac::scene
