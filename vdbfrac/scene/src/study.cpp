#include "study.h"

#include "tables.h"
#include "toml_text.h"

#include <algorithm>

namespace vdbfrac::scene {

namespace {

const Node* member(const Item& item, const char* key)
{
    return item.node.table() ? item.node.table()->find(key) : nullptr;
}

/// Calls read(entry) for each table of a list; what is no list is a complaint.
template <class Read>
void forEach(const Item& parent, const char* key, const Read& read)
{
    const Node* node = member(parent, key);
    if (!node) return;
    const Item list = parent.child(key, *node);
    if (const Array* array = node->array())
        for (std::size_t i = 0; i < array->items.size(); ++i) read(list.child(std::to_string(i), array->items[i]));
    else
        read(list);
}

template <class T>
void requireNew(const Item& item, const std::string& name, const std::vector<T>& before, Complaints& complaints)
{
    if (std::none_of(before.begin(), before.end(), [&](const T& t) { return t.name == name; })) return;
    const Node* given = member(item, "name");
    complaints.add(
        given ? given->place : item.node.place,
        {item.path + ".name is " + quotedText(name) + ", which is taken", "a name that no table before has"});
}

void requireAsMany(const Item& item, const std::vector<std::string>& values, std::size_t count, Complaints& complaints)
{
    if (values.size() == count) return;
    complaints.add(item.node.place, {item.path + " has " + std::to_string(values.size()) + " values",
                                     std::to_string(count) + ", as many as its series"});
}

Study::Series readSeries(const Item& item, Complaints& complaints)
{
    const Values v = readTable(item, tables::series(), complaints);
    Study::Series series;
    series.name = v.text("name");
    series.set = v.list("set");
    series.key = v.text("key");
    series.values = v.list("values");
    series.refines = v.text("refines");
    if (v.has("order")) series.order = v.number("order");
    forEach(item, "tied", [&](const Item& entry) {
        const Values t = readTable(entry, tables::tied(), complaints);
        series.tied.push_back({t.text("key"), t.list("values")});
        if (!series.values.empty()) requireAsMany(entry, series.tied.back().values, series.values.size(), complaints);
    });
    return series;
}

/// Reads a list of bodies or grips as names; fills in the only one where none is given.
template <class T>
void refer(const Item& item, const char* key, std::pair<const std::vector<T>&, std::string&> known,
           Complaints& complaints)
{
    auto& [all, name] = known;
    std::vector<std::string> names;
    for (const T& t : all) names.push_back(t.name);
    const Node* given = member(item, key);
    if (!given && all.size() == 1) {
        name = names[0];
    } else if (!given) {
        complaints.add(item.node.place,
                       {"[" + item.path + "] lacks the key '" + key + "'",
                        names.empty() ? "there is no " + std::string(key) : "one of " + joined(names)});
    } else if (given->text() && std::find(names.begin(), names.end(), name) == names.end()) {
        complaints.add(given->place, {"unknown " + std::string(key) + " " + describe(*given) + " in " + item.path,
                                      names.empty() ? "there is no " + std::string(key) : "one of " + joined(names),
                                      didYouMean(name, names)});
    }
}

bool isIn(const std::vector<const char*>& list, const std::string& key)
{
    return std::any_of(list.begin(), list.end(), [&](const char* entry) { return key == entry; });
}

/// A quantity has all that it needs, and nothing that would mean nothing.
void checkNeeds(const Item& item, const tables::Quantity& quantity, Complaints& complaints)
{
    for (const char* key : {"body", "grip", "point", "axis", "rest", "wavelength"}) {
        const Node* given = member(item, key);
        const bool needed = isIn(quantity.needs, key), known = needed || isIn(quantity.takes, key);
        const bool filledIn = isIn({"body", "grip"}, key);  // where there is one only
        if (given && !known)
            complaints.add(given->place,
                           {item.path + "." + key + " means nothing to the quantity " + quotedText(quantity.name), "",
                            "leave it out"});
        if (!given && needed && !filledIn)
            complaints.add(item.node.place, {"[" + item.path + "] lacks the key '" + key + "'", "",
                                             "the quantity " + quotedText(quantity.name) + " needs it"});
    }
}

template <class T>
std::optional<T> optionalOf(const Values& v, const char* key)
{
    return v.has(key) ? std::optional<T>(std::get<T>(v.all().at(key))) : std::nullopt;
}

Study::Measure readMeasure(const Item& item, const Scene& scene, Complaints& complaints)
{
    const std::size_t before = complaints.count();
    const Values v = readTable(item, tables::measure(), complaints);
    Study::Measure m;
    m.quantity = v.text("quantity");
    m.name = v.has("name") ? v.text("name") : m.quantity;
    m.source = v.text("source");
    if (complaints.count() != before) return m;
    const auto all = tables::quantities();
    const auto& quantity = *std::find_if(all.begin(), all.end(), [&](const auto& q) { return m.quantity == q.name; });
    if (v.has("body")) m.body = v.text("body");
    if (v.has("grip")) m.grip = v.text("grip");
    m.point = optionalOf<Vec3>(v, "point");
    m.axis = optionalOf<Vec3>(v, "axis");
    m.rest = optionalOf<double>(v, "rest");
    m.wavelength = optionalOf<double>(v, "wavelength");
    m.exact = optionalOf<double>(v, "exact");
    m.scale = optionalOf<double>(v, "scale");
    m.order = optionalOf<double>(v, "order");
    checkNeeds(item, quantity, complaints);
    if (isIn(quantity.needs, "body")) refer<Body>(item, "body", {scene.bodies, m.body}, complaints);
    if (isIn(quantity.needs, "grip")) refer<Grip>(item, "grip", {scene.grips, m.grip}, complaints);
    if (m.exact == 0. && !m.scale)
        complaints.add(member(item, "exact")->place, {item.path + ".exact is 0, and no error is relative to it", "",
                                                      "give scale, what errors are to be relative to"});
    return m;
}

}  // namespace

Study readStudy(const Item& item, const Scene& scene, Complaints& complaints)
{
    const Values v = readTable(item, tables::study(), complaints);
    Study study;
    study.about = v.text("about");
    study.rounds = int(v.integer("rounds"));
    forEach(item, "series", [&](const Item& entry) {
        Study::Series series = readSeries(entry, complaints);
        requireNew(entry, series.name, study.series, complaints);
        study.series.push_back(std::move(series));
    });
    forEach(item, "measure", [&](const Item& entry) {
        Study::Measure measure = readMeasure(entry, scene, complaints);
        requireNew(entry, measure.name, study.measures, complaints);
        study.measures.push_back(std::move(measure));
    });
    return study;
}

}  // namespace vdbfrac::scene
