#include <vdbfrac/lab/study/study_table.h>
#include <vdbfrac/lab/study/wedge_table.h>

#include <vdbfrac/effects/effects.h>
#include <vdbfrac/scene/review.h>

#include <fmt/format.h>

#include <algorithm>

namespace vdbfrac::lab::study {

namespace {

using scene::Key;
using scene::kOptional;
using scene::kRequired;
using scene::TableSpec;
using scene::Type;
using Series = Spec::Series;
using Measure = Spec::Measure;
using Names = std::vector<std::string>;

const Key kTied[] = {
    {.name = "key", .member = &Spec::Tied::key, .doc = "The key.", .defaultText = kRequired},
    {.name = "values",
     .member = {Type::scalars, &Spec::Tied::values},
     .doc = "Its values, one for each of the series.",
     .defaultText = kRequired},
};

void completeTied(scene::Review& tied)
{
    const std::size_t count = tied.values.list("values").size(), wanted = tied.parent().list("values").size();
    if (wanted > 0 && count != wanted)
        tied.complain("", {fmt::format("{} has {} values", tied.path(), count),
                           fmt::format("{}, as many as its series", wanted)});
}

const TableSpec kTiedSpec = {
    .name = "tied", .doc = "A key that changes along.", .keys = kTied, .complete = completeTied};

const Key kSeries[] = {
    {.name = "name",
     .member = &Series::name,
     .doc = "Name in table and plot; no two series share one.",
     .defaultText = kRequired},
    {.name = "set", .member = &Series::set, .doc = "Keys that are changed in all of it, as in --set: \"key=value\"."},
    {.name = "key", .member = &Series::key, .doc = "The key that is varied, as in --set.", .defaultText = kRequired},
    {.name = "values", .member = {Type::scalars, &Series::values}, .doc = "Its values.", .defaultText = kRequired},
    {.name = "tied",
     .member = {Type::entries, &Series::tied},
     .doc = "Keys that change along with it, each with as many values.",
     .table = &kTiedSpec},
    {.name = "refines",
     .member = {Type::choice, &Series::refines},
     .doc = "Which values are finer: higher ones, lower ones, or those that take more work.",
     .choices = {"auto", "up", "down"}},
    {.name = "order",
     .member = &Series::order,
     .doc = "Order of convergence that is expected.",
     .min = 0,
     .max = 20,
     .minOpen = true},
};

void completeSeries(scene::Review& series) { series.requireNewName(series.parent().tables("series")); }

const TableSpec kSeriesSpec = {
    .name = "study.series", .doc = "Settings that differ in one key.", .keys = kSeries, .complete = completeSeries};

/// What a quantity needs and what it may have besides name, exact, source, scale and order.
struct Quantity {
    const char* name;
    Names needs;
    Names takes = {};
};

const Quantity kQuantities[] = {
    {"displacement", {"body", "point"}, {"axis"}},
    {"period", {"body", "point", "axis"}, {"rest", "wavelength"}},
    {"damping", {"body", "point", "axis"}, {"rest", "wavelength"}},
    {"energy_norm", {}},
    {"peak_energy", {}},
    {"load_peak", {"grip"}, {"axis"}},
    {"load_end", {"grip"}, {"axis"}},
    {"load_work", {"grip"}},
    {"collider_load_peak", {"collider"}, {"axis"}},
    {"collider_load_end", {"collider"}, {"axis"}},
    {"onset", {}},
    {"dissipated", {}},
    {"energy_balance", {}},
    {"kinetic_energy", {}},
    {"momentum", {}},
    {"angular_momentum", {}},
    {"angular_velocity", {"body"}},
    {"volume", {}},
    {"fragments", {}},
    {"fragment_masses", {}},
};

std::vector<scene::Choice> quantityNames()
{
    std::vector<scene::Choice> names;
    for (const Quantity& q : kQuantities) names.emplace_back(q.name);
    return names;
}

const Key kMeasure[] = {
    {.name = "name",
     .member = {Type::label, &Measure::name},
     .doc = "Name of its column; that of the quantity without one.",
     .defaultText = kOptional},
    {.name = "quantity",
     .member = {Type::choice, &Measure::quantity},
     .doc = "What is measured; docs/commands.md explains each.",
     .defaultText = kRequired,
     .choices = quantityNames()},
    {.name = "body",
     .member = &Measure::body,
     .doc = "Name of the body; can be left out where there is one.",
     .defaultText = kOptional},
    {.name = "grip",
     .member = &Measure::grip,
     .doc = "Name of the grip; can be left out where there is one.",
     .defaultText = kOptional},
    {.name = "collider",
     .member = &Measure::collider,
     .doc = "Name of the collider; can be left out where there is one.",
     .defaultText = kOptional},
    {.name = "point", .member = &Measure::point, .unit = "m", .doc = "A point of the body, at rest."},
    {.name = "axis",
     .member = {Type::direction, &Measure::axis},
     .doc = "The component that counts; without it the magnitude."},
    {.name = "rest",
     .member = &Measure::rest,
     .unit = "m",
     .doc = "Displacement that an oscillation is about; its mean without one."},
    {.name = "wavelength",
     .member = &Measure::wavelength,
     .unit = "m",
     .doc = "Of the standing wave along the axis, 0 at the point, that alone counts.",
     .min = 0,
     .minOpen = true},
    {.name = "exact", .member = &Measure::exact, .doc = "The true value, where it is known."},
    {.name = "source", .member = &Measure::source, .doc = "Where the true value is from."},
    {.name = "scale",
     .member = &Measure::scale,
     .doc = "What errors are relative to, instead of the true value.",
     .min = 0,
     .minOpen = true},
    {.name = "order",
     .member = &Measure::order,
     .doc = "Order of convergence that is expected of it in all series, instead of theirs; 0: none.",
     .min = 0,
     .max = 20},
};

bool isIn(const Names& names, const std::string& name)
{
    return std::find(names.begin(), names.end(), name) != names.end();
}

/// A quantity has all that it needs, and nothing that would mean nothing.
void checkNeeds(scene::Review& measure, const Quantity& quantity)
{
    for (const std::string key : {"body", "grip", "collider", "point", "axis", "rest", "wavelength"}) {
        const bool given = measure.values.has(key), needed = isIn(quantity.needs, key);
        const bool filledIn = key == "body" || key == "grip" || key == "collider";  // where there is one only
        if (given && !needed && !isIn(quantity.takes, key))
            measure.complain(
                key, {fmt::format("{}.{} means nothing to the quantity \"{}\"", measure.path(), key, quantity.name), "",
                      "leave it out"});
        if (!given && needed && !filledIn)
            measure.complain(key, {fmt::format("[{}] lacks the key '{}'", measure.path(), key), "",
                                   fmt::format("the quantity \"{}\" needs it", quantity.name)});
    }
}

/// Reads the name of a body, a grip or a collider; fills in the only one where none is given.
template <class T>
void refer(scene::Review& measure, const std::string& key, const std::vector<T>& all)
{
    Names names;
    for (const T& t : all) names.push_back(t.name);
    if (measure.values.has(key))
        measure.requireOneOf(key, names);
    else if (names.size() == 1)
        measure.values.set(key, names[0]);
    else
        measure.complain(key,
                         {fmt::format("[{}] lacks the key '{}'", measure.path(), key),
                          names.empty() ? "there is no " + key : fmt::format("one of {}", fmt::join(names, ", "))});
}

void checkMeasure(scene::Review& measure)
{
    const scene::Values& v = measure.values;
    const Quantity& quantity = *std::find_if(std::begin(kQuantities), std::end(kQuantities),
                                             [&](const Quantity& q) { return v.text("quantity") == q.name; });
    checkNeeds(measure, quantity);
    if (isIn(quantity.needs, "body")) refer(measure, "body", measure.scene().bodies);
    if (isIn(quantity.needs, "grip")) refer(measure, "grip", measure.scene().grips);
    if (isIn(quantity.needs, "collider")) refer(measure, "collider", measure.scene().colliders);
    if (v.has("exact") && v.number("exact") == 0 && !v.has("scale"))
        measure.complain("exact", {measure.path() + ".exact is 0, and no error is relative to it", "",
                                   "give scale, what errors are to be relative to"});
}

void completeMeasure(scene::Review& measure)
{
    if (!measure.values.has("name")) measure.values.set("name", measure.values.text("quantity"));
    if (measure.isSound) checkMeasure(measure);
    measure.requireNewName(measure.parent().tables("measure"));
}

const TableSpec kMeasureSpec = {.name = "study.measure",
                                .doc = "A number that is taken of each run.",
                                .keys = kMeasure,
                                .complete = completeMeasure};

const Key kStudy[] = {
    {.name = "about", .member = &Spec::about, .doc = "What it shows, in a sentence."},
    {.name = "rounds",
     .member = &Spec::rounds,
     .doc = "How often each setting is timed; 0: values and work only.",
     .min = 0,
     .max = 1000},
    {.name = "series",
     .member = &Spec::series,
     .doc = "What is varied, each a curve; [[study.series]] tables.",
     .table = &kSeriesSpec},
    {.name = "measure",
     .member = &Spec::measures,
     .doc = "What is measured; [[study.measure]] tables.",
     .table = &kMeasureSpec},
};

const TableSpec kStudySpec = {.name = "study",
                              .doc = "Settings that 'vdbfrac study' compares; a simulation takes no notice of it.",
                              .keys = kStudy,
                              .inner = "studies"};

}  // namespace

scene::Vocabulary vocabulary()
{
    scene::Vocabulary all = effects::vocabulary();
    all.notes = {kStudySpec, wedgeTable()};
    return all;
}

std::optional<Spec> specOf(const scene::Scene& scene)
{
    for (const scene::NamedValues& note : scene.notes) {
        if (note.name != kStudySpec.name) continue;
        Spec spec;
        fill(spec, kStudy, note.values);
        return spec;
    }
    return {};
}

scene::NamedValues tableOf(const Spec& spec) { return {kStudySpec.name, valuesOf(spec, kStudy)}; }

}  // namespace vdbfrac::lab::study
