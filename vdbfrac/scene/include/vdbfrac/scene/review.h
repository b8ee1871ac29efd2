// For rules about a table of a vocabulary that involve several keys or the rest of the scene.
#pragma once

#include <vdbfrac/scene/scene.h>

#include <span>
#include <string>
#include <utility>
#include <vector>

namespace vdbfrac::scene {

struct Item;
class Complaints;

/// What is wrong, what would be right, and what to do. The last two may be empty.
struct Complaint {
    std::string what;
    std::string allowed = {};
    std::string hint = {};
};

/// A table of the text, just read: what TableSpec::complete sees, complains of and fills in.
class Review {
public:
    /// Where the table stands, what it belongs to, and who hears complaints.
    struct Around {
        const Item& item;
        const Values* parent;
        const Scene& scene;
        Complaints& complaints;
    };
    Review(Values& table, bool sound, const Around& around) : values(table), isSound(sound), around_(around) {}

    Values& values;      ///< with stand-ins for keys that are wrong or missing, and its inner tables
    const bool isSound;  ///< no key of its own was wrong or missing

    /// The scene's own tables have been read.
    const Scene& scene() const { return around_.scene; }
    /// Of the table that this one is an entry of, with the entries before this one. Not for other tables.
    const Values& parent() const { return *around_.parent; }
    /// As in complaints: "wind.layer.0".
    const std::string& path() const;

    /// At the key where it is given, else at the table.
    void complain(const std::string& key, Complaint complaint);
    /// The text given for a key must be one of `names`.
    void requireOneOf(const std::string& key, const std::vector<std::string>& names);
    /// The name of the table must not be that of one before.
    void requireNewName(std::span<const Values> before);
    /// The table, one of the `key` of what it belongs to, must be of a material of the scene, the first of it.
    void requireMaterial(const std::string& key);

private:
    Around around_;
};

}  // namespace vdbfrac::scene
