// The only file that includes toml++.
#include "document.h"

#include <vdbfrac/base/number_text.h>

// Header-only, also where the compile options of an installed package say otherwise. Numbers by <charconv>, which
// rounds correctly in any locale. A low nesting limit bounds the recursion, together with Scan.
#undef TOML_HEADER_ONLY
#undef TOML_SHARED_LIB
#define TOML_HEADER_ONLY 1
#define TOML_FLOAT_CHARCONV 1
#define TOML_MAX_NESTED_VALUES 32
#define TOML_ENABLE_FORMATTERS 0
#include <toml++/toml.h>

#include <algorithm>
#include <optional>
#include <tuple>

namespace vdbfrac::scene {

namespace {

constexpr int kMaxKeyDepth = 16;

Place placeOf(const toml::source_region& region) { return {region.begin.line, region.begin.column, -1}; }

/// Walks over a text, skipping strings and comments, and refuses what the parser cannot be trusted with:
/// - keys of too many parts ("a.a.a...."), of which it builds tables so deep that releasing them overflows the stack;
/// - characters beyond ASCII (TOML has none there), for which its test for white space is undefined.
class Scan {
public:
    explicit Scan(std::string_view text) : text_(text)
    {
        if (text_.starts_with("\xEF\xBB\xBF")) at_ = 3;  // a byte order mark
    }

    void run()
    {
        while (at_ < text_.size()) {
            const char c = text_[at_];
            if (c == '"' || c == '\'')
                skipString(c);
            else if (c == '#')
                skipTo('\n');
            else
                step(c);
        }
    }

private:
    void step(char c)
    {
        if (static_cast<unsigned char>(c) >= 0x80) throw SyntaxError{place(), "a special character outside of quotes"};
        if (c == '.')
            ++dots_;
        else if (std::string_view("=,[]{}\n").find(c) != std::string_view::npos)
            dots_ = 0;
        if (dots_ >= kMaxKeyDepth) throw SyntaxError{place(), "a key of more than 16 parts"};
        ++at_;
    }

    void skipTo(char end) { at_ = std::min(text_.find(end, at_), text_.size()); }

    void skipString(char quote)
    {
        const bool longForm = text_.substr(at_, 3) == std::string(3, quote);
        at_ += longForm ? 3 : 1;
        while (at_ < text_.size()) {
            if (text_[at_] == '\\' && quote == '"')
                skipBackslash();
            else if (!longForm && text_[at_] == '\n')
                return;  // unfinished: the parser stops there
            else if (!longForm && text_[at_] == quote)
                break;
            else if (longForm && text_.substr(at_, 3) == std::string(3, quote)) {
                at_ += 2;
                while (text_.substr(at_ + 1, 1) == std::string(1, quote)) ++at_;  // up to two belong to the string
                break;
            }
            ++at_;
        }
        ++at_;
    }

    /// Leaves the escaped character to be skipped next. In a long string the parser looks for white space after it.
    void skipBackslash()
    {
        ++at_;
        const std::size_t next = text_.find_first_not_of(" \t\r\n", at_);
        if (next < text_.size() && static_cast<unsigned char>(text_[next]) >= 0x80)
            throw SyntaxError{place(), "a special character after a backslash"};
    }

    Place place() const
    {
        const std::string_view before = text_.substr(0, at_);
        const std::size_t lineStart = before.rfind('\n') + 1;  // npos + 1 is 0
        return {unsigned(std::count(before.begin(), before.end(), '\n') + 1), unsigned(at_ - lineStart + 1), -1};
    }

    std::string_view text_;
    std::size_t at_ = 0;
    int dots_ = 0;
};

/// For a key given twice the parser tells the place of the value; people look for the key.
Place keyBefore(std::string_view text, Place place, std::string_view complaint)
{
    const std::size_t close = complaint.rfind('\'');
    const std::size_t open = close == std::string_view::npos || close == 0 ? close : complaint.rfind('\'', close - 1);
    if (complaint.find("redefine") == std::string_view::npos || open >= close) return place;
    for (unsigned line = 1; line < place.line && !text.empty(); ++line)
        text.remove_prefix(std::min(text.find('\n'), text.size() - 1) + 1);
    const std::string_view key = complaint.substr(open + 1, close - open - 1);
    const std::size_t at = text.substr(0, place.column - 1).rfind(key);
    if (at != std::string_view::npos) place.column = unsigned(at + 1);
    return place;
}

Node convert(const toml::node& node);

Array convert(const toml::array& array)
{
    Array out;
    for (const toml::node& item : array) out.items.push_back(convert(item));
    return out;
}

Table convert(const toml::table& table)
{
    Table out;
    for (const auto& [key, value] : table)
        out.members.push_back({std::string(key.str()), placeOf(key.source()), convert(value)});
    // The parser keeps them by name; people read from top to bottom.
    std::stable_sort(out.members.begin(), out.members.end(), [](const KeyValue& a, const KeyValue& b) {
        return std::tie(a.keyPlace.line, a.keyPlace.column) < std::tie(b.keyPlace.line, b.keyPlace.column);
    });
    return out;
}

Node convert(const toml::node& node)
{
    Node out{placeOf(node.source()), Date{}};
    if (const auto* v = node.as_boolean())
        out.value = v->get();
    else if (const auto* v = node.as_integer())
        out.value = static_cast<long long>(v->get());
    else if (const auto* v = node.as_floating_point())
        out.value = v->get();
    else if (const auto* v = node.as_string())
        out.value = v->get();
    else if (const auto* v = node.as_array())
        out.value = convert(*v);
    else if (const auto* v = node.as_table())
        out.value = convert(*v);
    return out;
}

template <class Members>
auto* findIn(Members& members, std::string_view key)
{
    const auto it = std::find_if(members.begin(), members.end(), [&](const KeyValue& m) { return m.key == key; });
    return it == members.end() ? nullptr : &it->value;
}

}  // namespace

const Node* Table::find(std::string_view key) const { return findIn(members, key); }
Node* Table::find(std::string_view key) { return findIn(members, key); }

Node parseDocument(std::string_view text)
{
    Scan(text).run();
    try {
        Node root = convert(static_cast<const toml::node&>(toml::parse(text)));
        root.place = {1, 1, -1};
        return root;
    } catch (const toml::parse_error& e) {
        const Place place = keyBefore(text, placeOf(e.source()), e.description());
        throw SyntaxError{place, std::string(e.description())};
    }
}

Node parseValue(std::string_view text)
{
    try {
        Node root = parseDocument("v = " + std::string(text));
        Table& table = std::get<Table>(root.value);
        if (table.members.size() == 1 && table.members[0].key == "v") return std::move(table.members[0].value);
    } catch (const SyntaxError&) {
    }
    // TOML wants digits on both sides of a point; who types .05 or 5. means a number too. All else is a text.
    if (const std::optional<double> number = numberFrom(text); number && text.find('.') != text.npos)
        return {{}, *number};
    return {{}, std::string(text)};
}

}  // namespace vdbfrac::scene
