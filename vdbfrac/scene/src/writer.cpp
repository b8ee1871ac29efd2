// writeScene: the same tables of keys as the reader, walked the other way.
#include "tables.h"
#include "toml_text.h"
#include "values_of.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/scene/reader.h>

#include <algorithm>

namespace vdbfrac::scene {

namespace {

/// "key = value" lines in the order of the spec.
std::string linesOf(const TableSpec& spec, const Content& content)
{
    std::string text;
    for (const Key& key : spec.keys) {
        const auto part = content.parts.find(key.name);
        if (part != content.parts.end())
            text += keyText(key.name) + " = " + part->second + "\n";
        else if (content.values.has(key.name))
            text += keyText(key.name) + " = " + valueText(content.values.all().at(key.name), key.type) + "\n";
    }
    return text;
}

std::string tableText(const std::string& header, const TableSpec& spec, const Content& content)
{
    return "\n" + header + "\n" + linesOf(spec, content);
}

std::string studyText(const Study& study)
{
    std::string text = tableText("[study]", tables::study(), contentOf(study));
    for (const Study::Series& s : study.series) text += tableText("[[study.series]]", tables::series(), contentOf(s));
    for (const Study::Measure& m : study.measures)
        text += tableText("[[study.measure]]", tables::measure(), contentOf(m));
    return text;
}

}  // namespace

std::string writeScene(const Scene& scene, std::span<const TableSpec> effects)
{
    std::string text = linesOf(tables::root(), contentOfRoot(scene));
    text += tableText("[time]", tables::time(), contentOf(scene.time));
    text += tableText("[grid]", tables::grid(), contentOf(scene.grid));
    for (const Body& body : scene.bodies) text += tableText("[[body]]", tables::body(), contentOf(body));
    for (const Material& m : scene.materials)
        text += tableText("[material." + keyText(m.name) + "]", tables::material(), contentOf(m));
    for (const Grip& grip : scene.grips) text += tableText("[[grip]]", tables::grip(), contentOf(grip));
    text += tableText("[solver]", tables::solver(), contentOf(scene.solver));
    text += tableText("[output]", tables::output(), contentOf(scene.output));
    for (const EffectTable& effect : scene.effects) {
        const auto spec =
            std::find_if(effects.begin(), effects.end(), [&](const TableSpec& s) { return effect.name == s.name; });
        if (spec == effects.end())
            throw Error("writeScene: no table of keys for the effect " + quotedText(effect.name));
        text += tableText("[" + keyText(effect.name) + "]", *spec, {effect.values});
    }
    if (scene.study) text += studyText(*scene.study);
    return text;
}

}  // namespace vdbfrac::scene
