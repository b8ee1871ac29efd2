#include <vdbfrac/scene/review.h>

#include "read_table.h"
#include "toml_text.h"

#include <algorithm>

namespace vdbfrac::scene {

const std::string& Review::path() const { return around_.item.path; }

void Review::complain(const std::string& key, Complaint complaint)
{
    const Node* given = around_.item.member(key);
    around_.complaints.add(given ? given->place : around_.item.node.place, std::move(complaint));
}

void Review::requireOneOf(const std::string& key, const std::vector<std::string>& names)
{
    const Node* given = around_.item.member(key);
    if (given && given->text() && std::find(names.begin(), names.end(), *given->text()) == names.end())
        complainUnknown(around_.item, key, names, around_.complaints);
}

void Review::requireNewName(std::span<const Values> before)
{
    const std::string& name = values.text("name");
    if (std::any_of(before.begin(), before.end(), [&](const Values& v) { return v.text("name") == name; }))
        complain("name",
                 {path() + ".name is " + quotedText(name) + ", which is taken", "a name that no table before has"});
}

void Review::requireMaterial(const std::string& key)
{
    std::vector<std::string> names;
    for (const Material& m : scene().materials) names.push_back(m.name);
    requireOneOf("name", names);
    requireNewName(parent().tables(key));
}

}  // namespace vdbfrac::scene
