#include "overrides.h"

#include "parts.h"
#include "toml_text.h"

#include <algorithm>
#include <charconv>

namespace vdbfrac::scene {

namespace {

/// The parts of a dotted key, read by the TOML parser so that quoted parts work; empty when it is none.
std::vector<std::string> splitPath(std::string_view path)
{
    std::vector<std::string> parts;
    try {
        const Node root = parseDocument(std::string(path) + " = 0");
        for (const Table* table = root.table(); table; table = table->members[0].value.table()) {
            if (table->members.size() != 1) return {};
            parts.push_back(table->members[0].key);
        }
    } catch (const SyntaxError&) {
        return {};
    }
    return parts;
}

void setPlace(Node& node, const Place& place)
{
    node.place = place;
    if (Array* array = std::get_if<Array>(&node.value))
        for (Node& item : array->items) setPlace(item, place);
    if (Table* table = std::get_if<Table>(&node.value)) {
        for (KeyValue& m : table->members) {
            m.keyPlace = place;
            setPlace(m.value, place);
        }
    }
}

bool isNamed(const Node& node, const std::string& name)
{
    const Table* table = node.table();
    const Node* given = table ? table->find("name") : nullptr;
    return given && given->text() && *given->text() == name;
}

/// Entry of a list by name or by index; nullptr when there is none. `list`: that its entries without a name are called
/// by, as outputs call them; empty where they are not.
Node* entryOf(Array& array, const std::string& step, const std::string& list)
{
    const auto it =
        std::find_if(array.items.begin(), array.items.end(), [&](const Node& item) { return isNamed(item, step); });
    if (it != array.items.end()) return &*it;
    std::size_t index = 0;
    const char* end = step.data() + step.size();
    const auto [stop, ec] = std::from_chars(step.data(), end, index);
    if (ec == std::errc() && stop == end) return index < array.items.size() ? &array.items[index] : nullptr;
    for (std::size_t i = 0; i < array.items.size(); ++i) {
        const Table* table = array.items[i].table();
        if (list.empty() || !table || table->find("name")) continue;
        std::size_t number = i + 1;
        const auto isTaken = [&](const Node& item) { return isNamed(item, list + std::to_string(number)); };
        while (std::ranges::any_of(array.items, isTaken)) ++number;
        if (step == list + std::to_string(number)) return &array.items[i];
    }
    return nullptr;
}

/// One step down; makes a missing member of a table.
Node* descend(Node& node, const std::string& step, const std::string& list, const Place& place)
{
    if (Array* array = std::get_if<Array>(&node.value)) return entryOf(*array, step, list);
    Table* table = std::get_if<Table>(&node.value);
    if (!table) return nullptr;
    if (Node* found = table->find(step)) return found;
    table->members.push_back({step, place, Node{place, Table{}}});
    return &table->members.back().value;
}

std::string deadEnd(const Node& node)
{
    if (const Array* array = node.array()) return "a list of " + std::to_string(array->items.size());
    return describe(node);
}

void apply(Node& root, const std::string& text, const Place& place, Complaints& complaints)
{
    const std::size_t equals = text.find('=');
    const std::vector<std::string> path = splitPath(std::string_view(text).substr(0, equals));
    if (equals == std::string::npos || path.empty()) {
        complaints.add(place, {describe({{}, text}) + " sets nothing",
                               "key.path=value, with entries of lists by index (from 0) or name: grip.0.until=2"});
        return;
    }
    Node* at = &root;
    for (std::size_t i = 0; i < path.size(); ++i) {
        const std::string& step = path[i];
        if (i > 0 && (path[i - 1] == "mesh" || path[i - 1] == "vdb")) *at = asFileTable(*at);
        const bool isCalled = i == 1 && (path[0] == "grip" || path[0] == "collider");
        Node* next = descend(*at, step, isCalled ? path[0] : "", place);
        if (!next) {
            complaints.add(place, {describe({{}, step}) + " leads nowhere: before it is " + deadEnd(*at),
                                   "a key of a table, or the index (from 0) or name of a list entry"});
            return;
        }
        at = next;
    }
    *at = parseValue(std::string_view(text).substr(equals + 1));
    setPlace(*at, place);
}

}  // namespace

void applyOverrides(Node& root, const std::vector<std::string>& overrides, Complaints& complaints)
{
    for (std::size_t i = 0; i < overrides.size(); ++i) apply(root, overrides[i], Place{0, 0, int(i)}, complaints);
}

}  // namespace vdbfrac::scene
