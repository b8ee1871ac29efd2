// defaultsText: the tables of keys as commented TOML.
#include "key_text.h"
#include "tables.h"
#include "toml_text.h"

#include <vdbfrac/scene/reader.h>

namespace vdbfrac::scene {

namespace {

constexpr const char* kPreamble =
    "# A scene of vdbfrac: every key with its default. SI units, y up.\n"
    "# Keys that begin with # have no default, or belong to a table that can be left out.\n";

std::string keyLines(const Key& key, bool commentedOut)
{
    std::string text = "# " + std::string(key.doc) + "\n#   " + allowedText(key);
    if (isRequired(key))
        text += "; required";
    else if (!hasDefault(key))
        text += "; optional";
    const std::string line = keyText(key.name) + " =" + (hasDefault(key) ? " " + std::string(key.defaultText) : "");
    return text + "\n" + (commentedOut || !hasDefault(key) ? "#" : "") + line + "\n";
}

std::string keysOf(const TableSpec& spec, bool commentedOut)
{
    std::string text;
    for (const Key& key : spec.keys) text += keyLines(key, commentedOut);
    return text;
}

std::string headerOf(const tables::Section& section)
{
    const std::string name = section.spec.name;
    switch (section.form) {
    case tables::Section::Form::single:
    case tables::Section::Form::optional: return "[" + name + "]";
    case tables::Section::Form::list: return "[[" + name + "]]";
    case tables::Section::Form::byName: return "[" + name + ".NAME]";
    }
    return "";
}

/// What can be left out altogether is shown commented out, all else as it would stand.
std::string sectionText(const tables::Section& section)
{
    const bool optional = section.form == tables::Section::Form::optional ||
                          (section.form == tables::Section::Form::list && !section.required);
    return "\n# " + std::string(section.spec.doc) + "\n" + (optional ? "#" : "") + headerOf(section) + "\n" +
           keysOf(section.spec, optional);
}

std::string effectText(const TableSpec& spec)
{
    return "\n# Effect, off without this table. " + std::string(spec.doc) + "\n#[" + keyText(spec.name) + "]\n" +
           keysOf(spec, true);
}

/// One inner table with its keys, all in comments.
std::string innerText(const TableSpec& spec, const std::string& form)
{
    std::string text = "#\n# " + form + "  " + spec.doc + "\n";
    for (const Key& key : spec.keys) {
        text += "#     " + std::string(key.name) + ": " + key.doc + "\n#         " + allowedText(key);
        text += isRequired(key)   ? "; required\n"
                : hasDefault(key) ? "; default " + std::string(key.defaultText) + "\n"
                                  : "; optional\n";
    }
    return text;
}

std::string innerTables()
{
    std::string text = "\n# Inner tables: solids and files (shape, add, cut, region), motions (move), studies.\n";
    for (const TableSpec& spec : tables::solids()) text += innerText(spec, "{ " + std::string(spec.name) + " = { } }");
    text += innerText(tables::meshFile(), "{ mesh = { } }, or { mesh = \"file\" }");
    text += innerText(tables::vdbFile(), "{ vdb = { } }, or { vdb = \"file\" }");
    for (const TableSpec& spec : tables::motions()) text += innerText(spec, "{ " + std::string(spec.name) + " = }");
    text += innerText(tables::pose(), "An entry of keys.");
    text += innerText(tables::series(), "[[study.series]]") + innerText(tables::tied(), "An entry of tied.");
    return text + innerText(tables::measure(), "[[study.measure]]");
}

}  // namespace

std::string defaultsText(std::span<const TableSpec> effects)
{
    std::string text = kPreamble + std::string("\n") + keysOf(tables::root(), false);
    for (const tables::Section& section : tables::sections()) text += sectionText(section);
    for (const TableSpec& effect : effects) text += effectText(effect);
    return text + innerTables();
}

}  // namespace vdbfrac::scene
