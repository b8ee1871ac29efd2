// What a key holds, and the member of a struct that keeps it.
#pragma once

#include <vdbfrac/scene/values.h>

#include <memory>
#include <optional>

namespace vdbfrac::scene {

struct Key;

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
    // Inner tables, which Key::table describes. Only those of a vocabulary have them.
    tables,   ///< [[table.key]]
    entries,  ///< a list of inline tables
    // Inner tables of the scene's own; they are not kept in Values.
    shape,     ///< a bounded solid or a file
    anyShape,  ///< a solid or a file
    solid,     ///< one Primitive
    solids,    ///< a list of them
    motion,    ///< what a grip does
    path,      ///< the same without forces
    poses,     ///< a list of PoseKey
};

/// A member of a struct that the tables of keys do not know.
class Access {
public:
    virtual ~Access() = default;
    /// What a new struct has; none where the member is empty.
    virtual std::optional<Values::Value> initial(const Key& key) const = 0;
};

/// A member of S.
template <class S>
class AccessIn : public Access {
public:
    virtual std::optional<Values::Value> get(const Key& key, const S& object) const = 0;
    virtual void set(const Key& key, S& object, const Values::Value& value) const = 0;
    std::optional<Values::Value> initial(const Key& key) const final { return get(key, S{}); }
};

struct Member {
    /// Kept in Values alone.
    Member(Type t) : type(t) {}
    /// Of the type that goes with T: bool, int, double, std::string, Vec3, an enum, a list; or std::optional of one.
    template <class S, class T>
    Member(T S::*member);
    template <class S, class T>
    Member(Type t, T S::*member);
    /// A range.
    template <class S>
    Member(int S::*first, int S::*last);

    Type type;
    std::shared_ptr<const Access> access = nullptr;
};

}  // namespace vdbfrac::scene
