#include "read_table.h"

#include "convert.h"
#include "key_text.h"
#include "tables.h"
#include "toml_text.h"

#include <algorithm>

namespace vdbfrac::scene {

namespace {

std::string tableText(const Item& item) { return item.path.empty() ? "the scene" : "[" + item.path + "]"; }

/// What stands in for a value that is wrong or missing, so that reading can go on to the next error.
Values::Value standIn(const Key& key)
{
    switch (key.type()) {
    case Type::boolean: return false;
    case Type::integer:
    case Type::autoInteger: return 0LL;
    case Type::number: return 0.0;
    case Type::vector: return Vec3(Vec3::Zero());
    case Type::direction: return Vec3(Vec3::UnitY());
    case Type::range: return Values::Range(0, 0);
    case Type::choices:
    case Type::texts:
    case Type::scalars: return std::vector<std::string>();
    case Type::curve: return Curve();
    default: return std::string();
    }
}

void readDefault(const Item& item, const Key& key, std::pair<Values&, Complaints&> out)
{
    if (key.defaultText == kOfMember) {
        if (auto initial = key.member.access->initial(key)) out.first.set(key.name, std::move(*initial));
        return;
    }
    const Node node = parseValue(key.defaultText);
    Conversion made = convert(node, key);
    if (!made.value)
        out.second.add(item.node.place, {"the default of " + item.child(key.name, node).path + " is " + describe(node),
                                         allowedText(key), "this is an error in the program"});
    out.first.set(key.name, made.value.value_or(standIn(key)));
}

void readGiven(const Item& given, const Key& key, std::pair<Values&, Complaints&> out)
{
    Conversion made = convert(given.node, key);
    if (!made.value) {
        const Place& place = made.culprit ? made.culprit->place : given.node.place;
        out.second.add(place, {given.path + " is " + describe(given.node), allowedText(key), made.hint});
    }
    out.first.set(key.name, made.value.value_or(standIn(key)));
}

void complainMissing(const Item& item, const Key& key, Complaints& complaints)
{
    complaints.add(item.node.place, {tableText(item) + " lacks the key '" + key.name + "'",
                                     std::string(key.name) + " = " + allowedText(key), key.doc});
}

}  // namespace

Values readKeys(const Item& item, const TableSpec& spec, Complaints& complaints)
{
    Values values;
    const std::size_t before = complaints.count();
    const Table* table = item.node.table();
    if (!table) complainType(item, "a table", complaints);
    for (const Key& key : spec.keys) {
        const Node* given = table ? table->find(key.name) : nullptr;
        if (!given && key.isRequired()) {
            if (table) complainMissing(item, key, complaints);
            if (!isPart(key)) values.set(key.name, standIn(key));
        } else if (isPart(key)) {
            continue;
        } else if (given) {
            readGiven(item.child(key.name, *given), key, {values, complaints});
        } else if (!key.isOptional()) {
            readDefault(item, key, {values, complaints});
        }
    }
    if (!spec.check || complaints.count() != before) return values;
    if (const std::string wrong = spec.check(values); !wrong.empty())
        complaints.add(item.node.place, {tableText(item) + ": " + wrong});
    return values;
}

Values readTable(const Item& item, const TableSpec& spec, Complaints& complaints)
{
    checkUnknown(item, tables::namesOf(spec.keys), complaints);
    return readKeys(item, spec, complaints);
}

namespace {

void readEntries(const Item& table, const Key& key, Values& values, const Scene& scene, Complaints& complaints)
{
    values.set(key.name, std::vector<Values>());
    const Node* node = table.member(key.name);
    if (!node) return;
    const auto read = [&](const Item& item) {
        values.append(key.name, readWithEntries(item, *key.table, scene, complaints, &values));
    };
    const Item list = table.child(key.name, *node);
    if (const Array* array = node->array())
        for (std::size_t i = 0; i < array->items.size(); ++i) read(list.child(std::to_string(i), array->items[i]));
    else
        read(list);
}

}  // namespace

Values readWithEntries(const Item& item, const TableSpec& spec, const Scene& scene, Complaints& complaints,
                       const Values* parent)
{
    const std::size_t before = complaints.count();
    Values values = readTable(item, spec, complaints);
    const bool isSound = complaints.count() == before;
    for (const Key& key : spec.keys)
        if (key.table) readEntries(item, key, values, scene, complaints);
    if (spec.complete) {
        Review review(values, isSound, {item, parent, scene, complaints});
        spec.complete(review);
    }
    return values;
}

void checkUnknown(const Item& item, const std::vector<std::string>& known, Complaints& complaints)
{
    const Table* table = item.node.table();
    if (!table) return;
    for (const KeyValue& m : table->members) {
        if (std::find(known.begin(), known.end(), m.key) != known.end()) continue;
        const std::string what = "unknown key " + describe({{}, m.key}) + " in " + tableText(item);
        complaints.add(m.keyPlace, {what, joined(known), didYouMean(m.key, known)});
    }
}

void complainType(const Item& item, const std::string& allowed, Complaints& complaints)
{
    complaints.add(item.node.place, {item.path + " is " + describe(item.node), allowed});
}

void complainUnknown(const Item& item, const std::string& key, const std::vector<std::string>& names,
                     Complaints& complaints)
{
    const Node& given = *item.member(key);
    complaints.add(given.place, {"unknown " + key + " " + describe(given) + " in " + item.path,
                                 names.empty() ? "there is no " + key : "one of " + joined(names),
                                 didYouMean(*given.text(), names)});
}

const KeyValue* onlyMember(const Item& item, const std::vector<std::string>& kinds, Complaints& complaints)
{
    const std::string allowed = "a table with exactly one of " + joined(kinds);
    const Table* table = item.node.table();
    if (!table) {
        complainType(item, allowed, complaints);
        return nullptr;
    }
    std::vector<const KeyValue*> found;
    for (const KeyValue& m : table->members)
        if (std::find(kinds.begin(), kinds.end(), m.key) != kinds.end()) found.push_back(&m);
    if (found.size() == 1) return found[0];
    if (found.size() > 1) {
        complaints.add(found[1]->keyPlace,
                       {item.path + " has " + std::to_string(found.size()) + " of " + joined(kinds), allowed});
    } else {
        const KeyValue* first = table->members.empty() ? nullptr : &table->members.front();
        complaints.add(
            first ? first->keyPlace : item.node.place,
            {item.path + (first ? " has '" + first->key + "' and none of " : " has none of ") + joined(kinds), allowed,
             first ? didYouMean(first->key, kinds) : ""});
    }
    return nullptr;
}

}  // namespace vdbfrac::scene
