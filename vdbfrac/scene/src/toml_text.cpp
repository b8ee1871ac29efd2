#include "toml_text.h"

#include "complaints.h"

#include <algorithm>
#include <array>
#include <charconv>

namespace vdbfrac::scene {

namespace {

constexpr std::size_t kDescriptionLength = 60;

std::string escaped(unsigned char c)
{
    static constexpr char kDigits[] = "0123456789abcdef";
    switch (c) {
    case '"': return "\\\"";
    case '\\': return "\\\\";
    case '\n': return "\\n";
    case '\t': return "\\t";
    case '\r': return "\\r";
    default: return {'\\', 'u', '0', '0', kDigits[c >> 4], kDigits[c & 15]};
    }
}

bool isBare(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
}

/// Cuts at most `length` bytes, never inside a UTF-8 character.
std::string shortened(std::string text, std::size_t length)
{
    if (text.size() <= length) return text;
    while (length > 0 && (static_cast<unsigned char>(text[length]) & 0xC0) == 0x80) --length;
    return text.substr(0, length) + "...";
}

struct Writer {
    Type type;
    const TableSpec* entries;

    std::string operator()(bool v) const { return v ? "true" : "false"; }
    std::string operator()(long long v) const
    {
        return type == Type::autoInteger && v == 0 ? quotedText("auto") : std::to_string(v);
    }
    std::string operator()(double v) const { return numberText(v); }
    std::string operator()(const std::string& v) const { return quotedText(v); }
    std::string operator()(const Vec3& v) const
    {
        return "[" + numberText(v[0]) + ", " + numberText(v[1]) + ", " + numberText(v[2]) + "]";
    }
    std::string operator()(const Values::Range& v) const
    {
        return "[" + std::to_string(v.first) + ", " + std::to_string(v.second) + "]";
    }
    std::string operator()(const std::vector<std::string>& v) const
    {
        std::vector<std::string> texts;
        for (const std::string& item : v) texts.push_back(type == Type::scalars ? item : quotedText(item));
        return "[" + joined(texts) + "]";
    }
    std::string operator()(const Curve& v) const
    {
        std::string text;
        for (const Curve::Key& k : v.keys)
            text += (text.empty() ? "{ time = " : ", { time = ") + numberText(k.time) +
                    ", scale = " + numberText(k.scale) + " }";
        return "[" + text + "]";
    }
    std::string operator()(const std::vector<Values>& v) const
    {
        std::vector<std::string> texts;
        for (const Values& entry : v) texts.push_back(inlineTable(*entries, entry));
        return "[" + joined(texts) + "]";
    }
};

struct Describer {
    std::string operator()(bool v) const { return v ? "true" : "false"; }
    std::string operator()(long long v) const { return std::to_string(v); }
    std::string operator()(double v) const { return numberText(v); }
    std::string operator()(const std::string& v) const { return quotedText(shortened(v, kDescriptionLength)); }
    std::string operator()(const Date&) const { return "a date or time"; }
    std::string operator()(const Table& v) const { return v.members.empty() ? "an empty table" : "a table"; }
    std::string operator()(const Array& v) const
    {
        std::string text;
        for (const Node& item : v.items) {
            if (text.size() > kDescriptionLength) break;
            text += (text.empty() ? "" : ", ") + std::visit(*this, item.value);
        }
        return "[" + shortened(std::move(text), kDescriptionLength) + "]";
    }
};

}  // namespace

std::string numberText(double number)
{
    std::array<char, 400> buffer;  // 1e308 without exponent is the longest
    const auto [end, ec] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), number);
    std::string text(buffer.data(), end);
    // Beyond 64 bits, digits alone would not read back; and -0 is a different number as an integer.
    const bool digitsAlone = text.find_first_not_of("0123456789-") == std::string::npos;
    if (digitsAlone && (text.size() > 17 || text == "-0")) text += ".0";
    return text;
}

std::string quotedText(std::string_view text)
{
    std::string out = "\"";
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte < 0x20 || byte == 0x7F || c == '"' || c == '\\')
            out += escaped(byte);
        else
            out += c;
    }
    return out + '"';
}

std::string keyText(std::string_view key)
{
    const bool bare = !key.empty() && std::all_of(key.begin(), key.end(), isBare);
    return bare ? std::string(key) : quotedText(key);
}

std::string valueText(const Values::Value& value, Type type, const TableSpec* entries)
{
    return std::visit(Writer{type, entries}, value);
}

std::vector<std::string> assignments(const TableSpec& spec, const Values& values, const PartTexts& parts)
{
    std::vector<std::string> texts;
    for (const Key& key : spec.keys) {
        const auto part = parts.find(key.name);
        if (part != parts.end())
            texts.push_back(keyText(key.name) + " = " + part->second);
        else if (key.type() != Type::tables && values.has(key.name))
            texts.push_back(keyText(key.name) + " = " + valueText(values.all().at(key.name), key.type(), key.table));
    }
    return texts;
}

std::string inlineTable(const TableSpec& spec, const Values& values, const PartTexts& parts)
{
    return "{ " + joined(assignments(spec, values, parts)) + " }";
}

std::string describe(const Node& node) { return std::visit(Describer{}, node.value); }

}  // namespace vdbfrac::scene
