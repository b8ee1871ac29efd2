// A parsed scene text as a plain tree in which every value knows its place.
#pragma once

#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace vdbfrac::scene {

/// Where something stands: line and column of the text, or the number of an override.
struct Place {
    unsigned line = 0;
    unsigned column = 0;
    int overrideIndex = -1;  ///< >= 0: it came with that override
};

struct KeyValue;
struct Node;

struct Array {
    std::vector<Node> items;
};

/// Members in the order of the text.
struct Table {
    std::vector<KeyValue> members;

    const Node* find(std::string_view key) const;
    Node* find(std::string_view key);
};

/// A date or time; no key takes one.
struct Date {};

struct Node {
    Place place;
    std::variant<bool, long long, double, std::string, Date, Array, Table> value;

    const Table* table() const { return std::get_if<Table>(&value); }
    const Array* array() const { return std::get_if<Array>(&value); }
    const std::string* text() const { return std::get_if<std::string>(&value); }
};

struct KeyValue {
    std::string key;
    Place keyPlace;
    Node value;
};

/// Thrown for a text that is no TOML.
struct SyntaxError {
    Place place;
    std::string what;
};

/// Parses a whole document; the result holds a Table. Throws SyntaxError, whatever the bytes.
Node parseDocument(std::string_view text);

/// Parses one TOML value. What is no TOML becomes a text.
Node parseValue(std::string_view text);

}  // namespace vdbfrac::scene
