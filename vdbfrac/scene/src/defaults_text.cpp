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
    const std::string value = defaultTextOf(key);
    std::string text = "# " + key.doc + "\n#   " + allowedText(key);
    if (value.empty()) text += key.isRequired() ? "; required" : "; optional";
    const std::string line = keyText(key.name) + " =" + (value.empty() ? "" : " " + value);
    return text + "\n" + (commentedOut || value.empty() ? "#" : "") + line + "\n";
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
    case tables::Section::Form::single: return "[" + name + "]";
    case tables::Section::Form::list: return "[[" + name + "]]";
    case tables::Section::Form::byName: return "[" + name + ".NAME]";
    }
    return "";
}

/// What can be left out altogether is shown commented out, all else as it would stand.
std::string sectionText(const tables::Section& section)
{
    const bool optional = section.form == tables::Section::Form::list && !section.required;
    return "\n# " + std::string(section.spec.doc) + "\n" + (optional ? "#" : "") + headerOf(section) + "\n" +
           keysOf(section.spec, optional);
}

/// A table of the vocabulary.
std::string optionalText(const TableSpec& spec)
{
    const std::string kind = spec.kind ? std::string(spec.kind) + ", off without this table. " : "";
    return "\n# " + kind + spec.doc + "\n#[" + keyText(spec.name) + "]\n" + keysOf(spec, true);
}

/// One inner table with its keys, all in comments.
std::string innerText(const TableSpec& spec, const std::string& form)
{
    std::string text = "#\n# " + form + "  " + spec.doc + "\n";
    for (const Key& key : spec.keys) {
        const std::string value = defaultTextOf(key);
        text += "#     " + std::string(key.name) + ": " + key.doc + "\n#         " + allowedText(key) + "; ";
        text += (!value.empty() ? "default " + value : key.isRequired() ? "required" : "optional") + "\n";
    }
    return text;
}

/// The inner tables that a vocabulary brings.
std::string entriesText(const TableSpec& spec)
{
    std::string text;
    for (const Key& key : spec.keys) {
        if (!key.table) continue;
        text += innerText(*key.table, key.type() == Type::tables ? "[[" + std::string(key.table->name) + "]]"
                                                                 : "An entry of " + std::string(key.name) + ".");
        text += entriesText(*key.table);
    }
    return text;
}

std::string innerTables(const std::vector<TableSpec>& brought)
{
    std::string text = "\n# Inner tables: solids and files (shape, add, cut, region), motions (move)";
    for (const TableSpec& spec : brought)
        if (spec.inner) text += ", " + std::string(spec.inner);
    text += ".\n";
    for (const TableSpec& spec : tables::solids()) text += innerText(spec, "{ " + std::string(spec.name) + " = { } }");
    text += innerText(tables::meshFile(), "{ mesh = { } }, or { mesh = \"file\" }");
    text += innerText(tables::vdbFile(), "{ vdb = { } }, or { vdb = \"file\" }");
    for (const TableSpec& spec : tables::motions()) text += innerText(spec, "{ " + std::string(spec.name) + " = }");
    text += innerText(tables::pose(), "An entry of keys.");
    for (const TableSpec& spec : brought) text += entriesText(spec);
    return text;
}

}  // namespace

std::string defaultsText(const Vocabulary& vocabulary)
{
    std::string text = kPreamble + std::string("\n") + keysOf(tables::root(), false);
    const tables::Output output(vocabulary);
    for (const tables::Section& section : tables::sections(output, vocabulary)) text += sectionText(section);
    const std::vector<TableSpec> brought = vocabulary.all();
    for (const TableSpec& spec : brought) text += optionalText(spec);
    return text + innerTables(brought);
}

}  // namespace vdbfrac::scene
