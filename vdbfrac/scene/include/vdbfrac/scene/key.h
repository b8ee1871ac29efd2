// A key of a scene: everything there is to know about it, stated once. Reading, writing, the manual and the schema
// walk the tables of keys.
#pragma once

#include <vdbfrac/scene/member.h>

#include <limits>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace vdbfrac::scene {

class Review;

/// What a member can keep instead of a name.
template <class T>
concept Meaning = std::is_enum_v<T> || std::is_same_v<T, bool>;

/// A name that a key takes, and what it stands for where a member keeps it.
struct Choice {
    Choice(std::string text) : name(std::move(text)) {}
    Choice(const char* text) : name(text) {}
    template <Meaning T>
    Choice(const char* text, T meaning) : name(text), value(static_cast<long long>(meaning))
    {
    }

    std::string name;
    long long value = 0;
};

inline constexpr const char* kRequired = nullptr;
inline constexpr const char* kOptional = "";
inline constexpr char kOfMember[] = "what the member of a new struct has";

struct Key {
    const char* name;
    Member member;  ///< a Type, a member pointer (&Time::fps), or both
    const char* unit = "";
    std::string doc = {};  ///< one sentence
    /// TOML text of the default; or kRequired, kOptional (there is none), kOfMember (an empty std::optional: none).
    const char* defaultText = kOfMember;
    /// Bounds of a number, of each component of a vector, of each end of a range, of each scale of a curve.
    double min = -std::numeric_limits<double>::infinity();
    double max = std::numeric_limits<double>::infinity();
    bool minOpen = false;  ///< the bound itself is not allowed
    bool maxOpen = false;
    std::vector<Choice> choices = {};         ///< for Type::choice and Type::choices
    const struct TableSpec* table = nullptr;  ///< for Type::tables and Type::entries: of each of them

    Type type() const { return member.type; }
    bool isRequired() const { return !defaultText || (defaultText == kOfMember && !member.access); }
    bool isOptional() const { return defaultText && !*defaultText; }
};

/// A table of keys.
struct TableSpec {
    const char* name;
    const char* doc;  ///< a sentence or two for the manual
    std::span<const Key> keys;
    /// Checks that involve several keys, once each of them is right; returns a complaint or "". May be null.
    std::string (*check)(const Values&) = nullptr;
    /// The same with the places of the text, called whatever is wrong, and fills in what follows. May be null.
    void (*complete)(Review&) = nullptr;
    const char* kind = nullptr;   ///< what the manual calls it
    const char* inner = nullptr;  ///< what the manual calls the tables in it
};

/// What a scene can say beyond its own tables. Those who know what it means bring it.
struct Vocabulary {
    struct Fields {
        std::vector<std::string> rest, deformed;  ///< in the rest configuration, and as deformed
    };
    std::vector<TableSpec> tables = {};  ///< parts of what is simulated; each can be left out
    std::vector<TableSpec> notes = {};   ///< the same, but a simulation takes no notice of them
    Fields fields = {};                  ///< that output.vdb can list
    bool colliders = false;              ///< does anyone know what [[collider]] means?

    std::vector<TableSpec> all() const;  ///< notes, then tables: as the manual and the schema have them
};

/// Sets the members that keep the values, whose keys are those of the table of S.
template <class S>
void fill(S& object, std::span<const Key> keys, const Values& values)
{
    for (const Key& key : keys)
        if (key.member.access && values.has(key.name))
            dynamic_cast<const AccessIn<S>&>(*key.member.access).set(key, object, values.all().at(key.name));
}

/// The way back. An optional member that is empty gives no value.
template <class S>
Values valuesOf(const S& object, std::span<const Key> keys)
{
    Values values;
    for (const Key& key : keys) {
        if (!key.member.access) continue;
        if (auto value = dynamic_cast<const AccessIn<S>&>(*key.member.access).get(key, object))
            values.set(key.name, std::move(*value));
    }
    return values;
}

}  // namespace vdbfrac::scene

#include <vdbfrac/scene/member_access.h>
