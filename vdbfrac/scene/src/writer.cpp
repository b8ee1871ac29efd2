// writeScene: the same tables of keys as the reader, walked the other way.
#include "parts_text.h"
#include "tables.h"
#include "toml_text.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/scene/reader.h>

#include <algorithm>

namespace vdbfrac::scene {

namespace {

std::string linesOf(const TableSpec& spec, const Values& values, const PartTexts& parts = {})
{
    std::string text;
    for (const std::string& line : assignments(spec, values, parts)) text += line + "\n";
    return text;
}

template <class S>
std::string tableText(const std::string& header, const TableSpec& spec, const S& object, const PartTexts& parts = {})
{
    return "\n" + header + "\n" + linesOf(spec, valuesOf(object, spec.keys), parts);
}

/// A table of the vocabulary, and behind it those in it.
std::string valuesText(const std::string& header, const TableSpec& spec, const Values& values)
{
    std::string text = "\n" + header + "\n" + linesOf(spec, values);
    for (const Key& key : spec.keys) {
        if (key.type() != Type::tables) continue;
        for (const Values& inner : values.tables(key.name))
            text += valuesText("[[" + std::string(key.table->name) + "]]", *key.table, inner);
    }
    return text;
}

std::string broughtText(const std::vector<NamedValues>& tables, const std::vector<TableSpec>& specs)
{
    std::string text;
    for (const NamedValues& table : tables) {
        const auto spec =
            std::find_if(specs.begin(), specs.end(), [&](const TableSpec& s) { return table.name == s.name; });
        if (spec == specs.end()) throw Error("writeScene: no table of keys for " + quotedText(table.name));
        text += valuesText("[" + keyText(table.name) + "]", *spec, table.values);
    }
    return text;
}

}  // namespace

std::string writeScene(const Scene& scene, const Vocabulary& vocabulary)
{
    Values root = valuesOf(scene, tables::root().keys);
    root.set("version", 1LL);
    std::string text = linesOf(tables::root(), root);
    text += tableText("[time]", tables::time(), scene.time);
    text += tableText("[grid]", tables::grid(), scene.grid);
    for (const Body& b : scene.bodies) text += tableText("[[body]]", tables::body(), b, partTexts(b));
    for (const Material& m : scene.materials)
        text += tableText("[material." + keyText(m.name) + "]", tables::material(), m);
    for (const Grip& g : scene.grips) text += tableText("[[grip]]", tables::grip(), g, partTexts(g));
    for (const Collider& c : scene.colliders) text += tableText("[[collider]]", tables::collider(), c, partTexts(c));
    text += tableText("[solver]", tables::solver(), scene.solver);
    text += tableText("[output]", tables::Output(vocabulary).spec(), scene.output);
    return text + broughtText(scene.tables, vocabulary.tables) + broughtText(scene.notes, vocabulary.notes);
}

void requireValid(const Scene& scene, const Vocabulary& vocabulary)
{
    parseScene(writeScene(scene, vocabulary), "scene", vocabulary);
}

}  // namespace vdbfrac::scene
