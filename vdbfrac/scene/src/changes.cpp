#include <vdbfrac/scene/changes.h>

#include <algorithm>
#include <map>
#include <sstream>

namespace vdbfrac::scene {

namespace {

struct TableText {
    std::string name;  // empty: what stands before all tables
    std::vector<std::pair<std::string, std::string>> values;

    const std::string* find(const std::string& key) const
    {
        const auto it = std::find_if(values.begin(), values.end(), [&](const auto& v) { return v.first == key; });
        return it != values.end() ? &it->second : nullptr;
    }
    std::string keyOf(const std::string& key) const { return name.empty() ? key : name + "." + key; }
    std::string text() const
    {
        std::string all = "{";
        for (const auto& [key, value] : values) all += (all.size() > 1 ? ", " : " ") + key + " = " + value;
        return all + " }";
    }
};

std::vector<TableText> tableTextsOf(std::string_view text)
{
    std::vector<TableText> tables(1);
    std::map<std::string, int> count;  // of lists of tables
    std::istringstream lines{std::string(text)};
    for (std::string line; std::getline(lines, line);) {
        if (line.empty() || line[0] == '#') continue;
        if (line.starts_with("[[")) {
            const std::string name = line.substr(2, line.size() - 4);
            tables.push_back({name + "." + std::to_string(count[name]++), {}});
        } else if (line[0] == '[') {
            tables.push_back({line.substr(1, line.size() - 2), {}});
        } else if (const std::size_t at = line.find(" = "); at != std::string::npos) {
            tables.back().values.emplace_back(line.substr(0, at), line.substr(at + 3));
        }
    }
    return tables;
}

const TableText* findTable(const std::vector<TableText>& tables, const std::string& name)
{
    const auto it = std::find_if(tables.begin(), tables.end(), [&](const TableText& t) { return t.name == name; });
    return it != tables.end() ? &*it : nullptr;
}

}  // namespace

std::vector<Change> changesBetween(std::string_view before, std::string_view after)
{
    const std::vector<TableText> then = tableTextsOf(before), now = tableTextsOf(after);
    std::vector<Change> changes;
    for (const TableText& table : now) {
        const TableText* const old = findTable(then, table.name);
        if (!old) {
            changes.push_back({table.name, "", table.text()});
            continue;
        }
        for (const auto& [key, value] : table.values) {
            const std::string* const was = old->find(key);
            if (!was || *was != value) changes.push_back({table.keyOf(key), was ? *was : "", value});
        }
        for (const auto& [key, value] : old->values)
            if (!table.find(key)) changes.push_back({table.keyOf(key), value, ""});
    }
    for (const TableText& table : then)
        if (!findTable(now, table.name)) changes.push_back({table.name, table.text(), ""});
    return changes;
}

}  // namespace vdbfrac::scene
