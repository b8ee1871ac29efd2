// The table of keys that drives validation, defaults, help and schema; and checked values by key.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/scene/curve.h>

#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace vdbfrac::scene {

enum class Type {
    boolean,
    integer,
    number,  ///< finite; integers are taken too
    text,
    vector,       ///< three finite numbers
    choice,       ///< a text out of Key::choices
    label,        ///< a text that can be part of a file name
    direction,    ///< "x", "y", "z" or a vector that is not zero; kept with unit length
    autoInteger,  ///< an integer, or "auto", kept as 0
    range,        ///< two integers [first, last], not falling
    choices,      ///< a list out of Key::choices, each at most once
    curve,        ///< a list of tables {time, scale}, times rising
    texts,        ///< a list of texts
    scalars,      ///< a list of numbers, texts, or booleans, not empty; kept as TOML texts
    // Inner tables. Only the scene's own tables have them; they are not kept in Values.
    shape,   ///< a solid or a file
    solid,   ///< one Primitive
    solids,  ///< a list of them
    motion,  ///< what a grip does
    poses,   ///< a list of PoseKey
    series,  ///< lists of what a study runs and measures
    tied,
    measures,
};

/// One key of a table: everything there is to know about it, stated once.
struct Key {
    const char* name;
    Type type;
    const char* unit;         ///< "m", "Pa", ...; "" for none
    const char* doc;          ///< one sentence
    const char* defaultText;  ///< TOML text of the default; nullptr: required, "": optional without default
    /// Bounds of a number, of each component of a vector, of each end of a range, of each scale of a curve.
    double least = -std::numeric_limits<double>::infinity();
    double most = std::numeric_limits<double>::infinity();
    bool leastOpen = false;  ///< the bound itself is not allowed
    bool mostOpen = false;
    std::vector<const char*> choices = {};  ///< for Type::choice and Type::choices
};

/// A table of keys. Effects bring one each.
struct TableSpec {
    const char* name;
    const char* doc;  ///< a sentence or two for the manual
    std::span<const Key> keys;
    /// Checks that involve several keys; returns a complaint or "". May be null.
    std::string (*check)(const class Values&) = nullptr;
};

/// Checked values of one table, defaults filled in. Asking for a key of another type is an assertion.
class Values {
public:
    using Range = std::pair<long long, long long>;
    using Value = std::variant<bool, long long, double, std::string, Vec3, Range, std::vector<std::string>, Curve>;

    bool has(const std::string& key) const { return values_.count(key) != 0; }  ///< set, or has a default
    bool boolean(const std::string& key) const { return std::get<bool>(values_.at(key)); }
    long long integer(const std::string& key) const { return std::get<long long>(values_.at(key)); }
    double number(const std::string& key) const { return std::get<double>(values_.at(key)); }
    const std::string& text(const std::string& key) const { return std::get<std::string>(values_.at(key)); }
    Vec3 vector(const std::string& key) const { return std::get<Vec3>(values_.at(key)); }
    Range range(const std::string& key) const { return std::get<Range>(values_.at(key)); }
    const std::vector<std::string>& list(const std::string& key) const
    {
        return std::get<std::vector<std::string>>(values_.at(key));
    }
    const Curve& curve(const std::string& key) const { return std::get<Curve>(values_.at(key)); }
    void set(const std::string& key, Value value) { values_[key] = std::move(value); }
    const std::map<std::string, Value>& all() const { return values_; }

private:
    std::map<std::string, Value> values_;
};

}  // namespace vdbfrac::scene
