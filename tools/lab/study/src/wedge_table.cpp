#include <vdbfrac/lab/study/wedge_table.h>

#include <vdbfrac/scene/review.h>

#include <fmt/format.h>

namespace vdbfrac::lab::study {

namespace {

using scene::Key;
using scene::kRequired;
using scene::TableSpec;
using scene::Type;
using Vary = WedgeSpec::Vary;

constexpr int kMaxCount = 10000;

const Key kVary[] = {
    {.name = "key", .member = &Vary::key, .doc = "The key, as in --set.", .defaultText = kRequired},
    {.name = "values", .member = {Type::scalars, &Vary::values}, .doc = "Its values.", .defaultText = scene::kOptional},
    {.name = "count",
     .member = &Vary::count,
     .doc = "In place of values: 1, 2, ... up to this, as for seeds.",
     .min = 0,
     .max = kMaxCount},
};

void completeVary(scene::Review& vary)
{
    const bool lists = vary.values.has("values"), counts = vary.values.integer("count") > 0;
    if (lists == counts)
        vary.complain("", {fmt::format("[[{}]] has {} values and count", vary.path(), lists ? "both" : "neither"),
                           "either of them"});
}

const TableSpec kVarySpec = {
    .name = "wedge.vary", .doc = "A key and its values.", .keys = kVary, .complete = completeVary};

const Key kWedge[] = {
    {.name = "about", .member = &WedgeSpec::about, .doc = "What it is for, in a sentence."},
    {.name = "combine",
     .member = {Type::choice, &WedgeSpec::combine},
     .doc = "Every value with every other, or the first of each key, the second of each key, ...",
     .choices = {"grid", "list"}},
    {.name = "vary",
     .member = &WedgeSpec::vary,
     .doc = "What differs between the runs; [[wedge.vary]] tables.",
     .table = &kVarySpec},
};

const TableSpec kWedgeSpec = {
    .name = "wedge",
    .doc = "Runs that 'vdbfrac wedge' makes of the scene; a simulation takes no notice of it.",
    .keys = kWedge,
    .inner = "wedges"};

}  // namespace

const TableSpec& wedgeTable() { return kWedgeSpec; }

std::optional<WedgeSpec> wedgeOf(const scene::Scene& scene)
{
    for (const scene::NamedValues& note : scene.notes) {
        if (note.name != std::string(kWedgeSpec.name)) continue;
        WedgeSpec spec;
        fill(spec, kWedge, note.values);
        return spec;
    }
    return {};
}

}  // namespace vdbfrac::lab::study
