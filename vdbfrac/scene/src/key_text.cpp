#include "key_text.h"

#include "complaints.h"
#include "tables.h"
#include "toml_text.h"

#include <cmath>

namespace vdbfrac::scene {

namespace {

std::string choicesText(const Key& key, const std::string& lastWord)
{
    std::vector<std::string> names;
    for (const Choice& choice : key.choices) names.push_back(quotedText(choice.name));
    return joined(names, lastWord);
}

/// Whole numbers as people write them: 1000000, not 1e+06.
std::string boundText(double bound)
{
    const bool plain = std::floor(bound) == bound && std::abs(bound) < 1e7;
    return plain ? std::to_string(static_cast<long long>(bound)) : numberText(bound);
}

/// " from 3 to 10", " greater than 0", ... or "" without bounds.
std::string boundsText(const Key& key)
{
    const bool below = std::isfinite(key.min);
    const bool above = std::isfinite(key.max);
    if (below && above && key.min == key.max) return " equal to " + boundText(key.min);
    if (below && above && !key.minOpen && !key.maxOpen)
        return " from " + boundText(key.min) + " to " + boundText(key.max);
    std::string text;
    if (below) text += (key.minOpen ? " greater than " : " not less than ") + boundText(key.min);
    if (below && above) text += " and";
    if (above) text += (key.maxOpen ? " less than " : " not more than ") + boundText(key.max);
    return text;
}

std::string formText(const Key& key)
{
    const std::string bounds = boundsText(key);
    const std::string each = bounds.empty() ? "" : ", each" + bounds;
    switch (key.type()) {
    case Type::boolean: return "true or false";
    case Type::integer: return "an integer" + bounds;
    case Type::number: return "a number" + bounds;
    case Type::text: return "a text";
    case Type::vector: return "three numbers [x, y, z]" + each;
    case Type::choice: return choicesText(key, "or");
    case Type::label: return "a text for file names: no / or \\ or control characters, no dot at the start";
    case Type::direction: return "\"x\", \"y\", \"z\", or three numbers [x, y, z] that are not all zero";
    case Type::autoInteger: return "\"auto\" or an integer" + bounds;
    case Type::range: return "two integers [first, last], first <= last" + each;
    case Type::choices: return "a list of " + choicesText(key, "and") + ", each at most once";
    case Type::curve:
        return "a list of tables {time, scale}, times rising" + (bounds.empty() ? "" : ", each scale" + bounds);
    case Type::texts: return "a list of texts";
    case Type::scalars: return "a list of at least one number, text, true or false";
    case Type::tables: return "tables [[" + std::string(key.table->name) + "]]";
    case Type::entries: return "a list of tables {" + joined(tables::namesOf(key.table->keys)) + "}";
    case Type::shape: return "a table with exactly one of box, sphere, cylinder, capsule, torus, mesh, vdb";
    case Type::anyShape:
        return "a table with exactly one of box, sphere, cylinder, capsule, torus, halfspace, mesh, vdb";
    case Type::solid: return "a table with exactly one of box, sphere, cylinder, capsule, torus, halfspace";
    case Type::solids:
        return "a list of tables, each with one of box, sphere, cylinder, capsule, torus; in cut also halfspace";
    case Type::motion: return "a table with exactly one of velocity, keys, force";
    case Type::path: return "a table with exactly one of velocity, keys";
    case Type::poses: return "a list of tables {time, translate, rotate}, times rising";
    }
    return "";
}

}  // namespace

std::string allowedText(const Key& key)
{
    const std::string unit = key.unit;
    return formText(key) + (unit.empty() ? "" : " (" + unit + ")");
}

std::string defaultTextOf(const Key& key)
{
    if (key.isRequired()) return "";
    if (key.defaultText != kOfMember) return key.defaultText;
    const auto initial = key.member.access->initial(key);
    return initial ? valueText(*initial, key.type(), key.table) : "";
}

}  // namespace vdbfrac::scene
