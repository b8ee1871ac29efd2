#include "convert.h"

#include "complaints.h"
#include "toml_text.h"

#include <algorithm>
#include <cmath>

namespace vdbfrac::scene {

namespace {

bool inBounds(double number, const Key& key)
{
    const bool above = key.minOpen ? number > key.min : number >= key.min;
    const bool below = key.maxOpen ? number < key.max : number <= key.max;
    return std::isfinite(number) && above && below;
}

std::optional<double> numberIn(const Node& node, const Key& key)
{
    double number = std::nan("");
    if (const auto* v = std::get_if<double>(&node.value)) number = *v;
    if (const auto* v = std::get_if<long long>(&node.value)) number = double(*v);
    return inBounds(number, key) ? std::optional(number) : std::nullopt;
}

std::optional<long long> integerIn(const Node& node, const Key& key)
{
    const auto* v = std::get_if<long long>(&node.value);
    return v && inBounds(double(*v), key) ? std::optional(*v) : std::nullopt;
}

Conversion toNumber(const Node& node, const Key& key)
{
    if (const auto number = numberIn(node, key)) return {*number};
    const std::string* text = node.text();
    const bool inQuotes = text && numberIn(parseValue(*text), key);
    return {{}, nullptr, inQuotes ? "write it without quotes" : ""};
}

Conversion toInteger(const Node& node, const Key& key)
{
    if (const auto integer = integerIn(node, key)) return {*integer};
    const auto* number = std::get_if<double>(&node.value);
    const bool whole = number && inBounds(*number, key) && std::floor(*number) == *number;
    const bool inQuotes = node.text() && integerIn(parseValue(*node.text()), key);
    return {{}, nullptr, whole ? "write it without a point" : inQuotes ? "write it without quotes" : ""};
}

Conversion toVector(const Node& node, const Key& key)
{
    const Array* array = node.array();
    if (!array || array->items.size() != 3) return {};
    Vec3 vector;
    for (int i = 0; i < 3; ++i) {
        const Node& item = array->items[std::size_t(i)];
        const auto number = numberIn(item, key);
        if (!number) return {{}, &item};
        vector[i] = *number;
    }
    return {vector};
}

/// Divides by the largest component first, so that no square over- or underflows. A vector that is of unit length to
/// rounding stays as it is: what was written out reads back to the same bits.
Vec3 unitLength(const Vec3& v)
{
    constexpr double kRounding = 1e-15;
    if (std::abs(v.squaredNorm() - 1) < kRounding) return v;
    const Vec3 scaled = v / v.cwiseAbs().maxCoeff();
    return scaled / scaled.norm();
}

Conversion toDirection(const Node& node, const Key& key)
{
    if (const std::string* text = node.text()) {
        if (*text == "x") return {Vec3(Vec3::UnitX())};
        if (*text == "y") return {Vec3(Vec3::UnitY())};
        if (*text == "z") return {Vec3(Vec3::UnitZ())};
        return {};
    }
    Conversion made = toVector(node, key);
    if (!made.value) return made;
    const Vec3 vector = std::get<Vec3>(*made.value);
    if (vector.isZero(0)) return {};
    return {unitLength(vector)};
}

Conversion toChoice(const Node& node, const Key& key)
{
    const std::string* text = node.text();
    if (!text) return {};
    if (choiceValue(key, *text)) return {*text};
    std::vector<std::string> names;
    for (const Choice& choice : key.choices) names.push_back(choice.name);
    return {{}, nullptr, didYouMean(*text, names)};
}

Conversion toChoices(const Node& node, const Key& key)
{
    const Array* array = node.array();
    if (!array) return {{}, nullptr, node.text() ? "put it in brackets" : ""};
    std::vector<std::string> list;
    for (const Node& item : array->items) {
        const Conversion made = toChoice(item, key);
        if (!made.value) return {{}, &item, made.hint};
        const std::string& text = *item.text();
        if (std::find(list.begin(), list.end(), text) != list.end()) return {{}, &item, "it is there twice"};
        list.push_back(text);
    }
    return {list};
}

Conversion toTexts(const Node& node)
{
    const Array* array = node.array();
    if (!array) return {{}, nullptr, node.text() ? "put it in brackets" : ""};
    std::vector<std::string> list;
    for (const Node& item : array->items) {
        if (!item.text()) return {{}, &item};
        list.push_back(*item.text());
    }
    return {list};
}

/// As TOML text; empty for a list, a table or a date.
std::string scalarText(const Node& node)
{
    if (const auto* v = std::get_if<bool>(&node.value)) return valueText(*v, Type::boolean);
    if (const auto* v = std::get_if<long long>(&node.value)) return valueText(*v, Type::integer);
    if (const auto* v = std::get_if<double>(&node.value)) return valueText(*v, Type::number);
    return node.text() ? quotedText(*node.text()) : "";
}

Conversion toScalars(const Node& node)
{
    const Array* array = node.array();
    if (!array || array->items.empty()) return {{}, nullptr, array ? "" : "put it in brackets"};
    std::vector<std::string> list;
    for (const Node& item : array->items) {
        list.push_back(scalarText(item));
        if (list.back().empty()) return {{}, &item};
    }
    return {list};
}

Conversion toLabel(const Node& node)
{
    constexpr std::size_t kMaxLength = 128;  // leaves room for frame number and suffix in 255 bytes
    const std::string* text = node.text();
    if (!text || text->empty() || text->size() > kMaxLength || text->front() == '.') return {};
    const auto bad = [](char c) { return c == '/' || c == '\\' || static_cast<unsigned char>(c) < 0x20 || c == 0x7F; };
    if (std::any_of(text->begin(), text->end(), bad)) return {};
    return {*text};
}

Conversion toRange(const Node& node, const Key& key)
{
    const Array* array = node.array();
    if (!array || array->items.size() != 2) return {};
    const auto first = integerIn(array->items[0], key);
    const auto last = integerIn(array->items[1], key);
    if (!first) return {{}, &array->items[0]};
    if (!last) return {{}, &array->items[1]};
    if (*first > *last) return {{}, nullptr, "swap them"};
    return {Values::Range(*first, *last)};
}

Conversion toCurve(const Node& node, const Key& key)
{
    const Key time = {.name = "time", .member = Type::number};
    const Array* array = node.array();
    if (!array || array->items.empty()) return {};
    Curve curve;
    for (const Node& item : array->items) {
        const Table* entry = item.table();
        const Node *when = entry ? entry->find("time") : nullptr, *what = entry ? entry->find("scale") : nullptr;
        if (!when || !what || entry->members.size() != 2)
            return {{}, &item, "each with time and scale, and nothing else"};
        const auto t = numberIn(*when, time), scale = numberIn(*what, key);
        if (!t || !scale) return {{}, t ? what : when};
        if (!curve.keys.empty() && *t <= curve.keys.back().time) return {{}, when, "later than the entry before"};
        curve.keys.push_back({*t, *scale});
    }
    return {curve};
}

}  // namespace

Conversion convert(const Node& node, const Key& key)
{
    switch (key.type()) {
    case Type::boolean:
        if (const bool* v = std::get_if<bool>(&node.value)) return {*v};
        return {{}, nullptr, node.text() ? "write it without quotes" : ""};
    case Type::integer: return toInteger(node, key);
    case Type::number: return toNumber(node, key);
    case Type::text: return node.text() ? Conversion{*node.text()} : Conversion{};
    case Type::vector: return toVector(node, key);
    case Type::choice: return toChoice(node, key);
    case Type::label: return toLabel(node);
    case Type::direction: return toDirection(node, key);
    case Type::autoInteger:
        if (node.text() && *node.text() == "auto") return {0LL};
        return toInteger(node, key);
    case Type::range: return toRange(node, key);
    case Type::choices: return toChoices(node, key);
    case Type::curve: return toCurve(node, key);
    case Type::texts: return toTexts(node);
    case Type::scalars: return toScalars(node);
    default: return {};  // parts
    }
}

}  // namespace vdbfrac::scene
