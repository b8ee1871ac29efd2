// Reads a table of the document by its keys: types, ranges, unknown and missing keys, defaults.
#pragma once

#include "complaints.h"
#include "document.h"

#include <vdbfrac/scene/key.h>
#include <vdbfrac/scene/review.h>

#include <string>

namespace vdbfrac::scene {

/// A value of the document and its key path, "body.0.shape.box".
struct Item {
    const Node& node;
    std::string path;

    Item child(const std::string& key, const Node& value) const
    {
        return {value, path.empty() ? key : path + "." + key};
    }
    /// What a table has for a key, or nullptr.
    const Node* member(const std::string& key) const { return node.table() ? node.table()->find(key) : nullptr; }
};

/// The values of all keys of a table but its parts, defaults filled in. Every wrong, unknown or missing key is a
/// complaint, and a stand-in takes its place, so that every required key has a value.
Values readTable(const Item& item, const TableSpec& spec, Complaints& complaints);

/// Reads a table into the struct that its keys fill.
template <class S>
void readInto(S& object, const Item& item, const TableSpec& spec, Complaints& complaints)
{
    fill(object, spec.keys, readTable(item, spec, complaints));
}

/// The values without a complaint about unknown keys, for the root, where tables stand beside keys.
Values readKeys(const Item& item, const TableSpec& spec, Complaints& complaints);

/// A table of a vocabulary with its inner tables; `parent` is the one that it is an entry of, if any.
Values readWithEntries(const Item& item, const TableSpec& spec, const Scene& scene, Complaints& complaints,
                       const Values* parent = nullptr);

/// Complains about each member of a table whose key is not among `known`.
void checkUnknown(const Item& item, const std::vector<std::string>& known, Complaints& complaints);

/// Complains that a value is not what it should be.
void complainType(const Item& item, const std::string& allowed, Complaints& complaints);

/// Complains that the text given for a key is not among `names`.
void complainUnknown(const Item& item, const std::string& key, const std::vector<std::string>& names,
                     Complaints& complaints);

/// Key of a table that has exactly one of `kinds`; complains and returns nullptr when there is none or are several.
const KeyValue* onlyMember(const Item& item, const std::vector<std::string>& kinds, Complaints& complaints);

}  // namespace vdbfrac::scene
