#include <vdbfrac/scene/key.h>

#include <algorithm>
#include <cassert>

namespace vdbfrac::scene {

const std::string& choiceName(const Key& key, long long value)
{
    const auto it =
        std::find_if(key.choices.begin(), key.choices.end(), [&](const Choice& c) { return c.value == value; });
    assert(it != key.choices.end());
    return it->name;
}

std::optional<long long> choiceValue(const Key& key, const std::string& name)
{
    const auto it =
        std::find_if(key.choices.begin(), key.choices.end(), [&](const Choice& c) { return c.name == name; });
    return it == key.choices.end() ? std::nullopt : std::optional(it->value);
}

}  // namespace vdbfrac::scene
