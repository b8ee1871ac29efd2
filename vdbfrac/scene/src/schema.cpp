// schemaText: the tables of keys as JSON Schema.
#include "document.h"
#include "key_text.h"
#include "tables.h"

#include <vdbfrac/scene/reader.h>

#include <nlohmann/json.hpp>

#include <cmath>

namespace vdbfrac::scene {

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kLabelPattern = R"(^[^./\\\u0000-\u001f\u007f][^/\\\u0000-\u001f\u007f]*$)";

struct ToJson {
    Json operator()(bool v) const { return v; }
    Json operator()(long long v) const { return v; }
    Json operator()(double v) const { return v; }
    Json operator()(const std::string& v) const { return v; }
    Json operator()(const Date&) const { return nullptr; }
    Json operator()(const Table& v) const
    {
        Json object = Json::object();
        for (const KeyValue& m : v.members) object[m.key] = std::visit(*this, m.value.value);
        return object;
    }
    Json operator()(const Array& v) const
    {
        Json array = Json::array();
        for (const Node& item : v.items) array.push_back(std::visit(*this, item.value));
        return array;
    }
};

Json reference(const char* definition) { return {{"$ref", std::string("#/definitions/") + definition}}; }

Json boundOf(double bound)
{
    const bool plain = std::floor(bound) == bound && std::abs(bound) < 1e15;
    return plain ? Json(static_cast<long long>(bound)) : Json(bound);
}

Json bounded(const char* type, const Key& key)
{
    Json schema = {{"type", type}};
    if (std::isfinite(key.min)) schema[key.minOpen ? "exclusiveMinimum" : "minimum"] = boundOf(key.min);
    if (std::isfinite(key.max)) schema[key.maxOpen ? "exclusiveMaximum" : "maximum"] = boundOf(key.max);
    return schema;
}

Json listOf(Json items, int length = -1)
{
    Json schema = {{"type", "array"}, {"items", std::move(items)}};
    if (length >= 0) schema["minItems"] = schema["maxItems"] = length;
    return schema;
}

Json choiceOf(const Key& key)
{
    std::vector<std::string> names;
    for (const Choice& choice : key.choices) names.push_back(choice.name);
    return {{"type", "string"}, {"enum", names}};
}

Json curveOf(const Key& key)
{
    Json entry = {{"type", "object"},
                  {"properties", {{"time", {{"type", "number"}}}, {"scale", bounded("number", key)}}}};
    entry["required"] = {"time", "scale"};
    entry["additionalProperties"] = false;
    Json schema = listOf(std::move(entry));
    schema["minItems"] = 1;
    return schema;
}

Json oneOf(std::initializer_list<Json> schemas)
{
    Json list = Json::array();
    for (const Json& schema : schemas) list.push_back(schema);
    return {{"oneOf", list}};
}

Json typeSchema(const Key& key)
{
    switch (key.type()) {
    case Type::boolean: return {{"type", "boolean"}};
    case Type::integer: return bounded("integer", key);
    case Type::number: return bounded("number", key);
    case Type::text: return {{"type", "string"}};
    case Type::vector: return listOf(bounded("number", key), 3);
    case Type::choice: return choiceOf(key);
    case Type::label: return {{"type", "string"}, {"pattern", kLabelPattern}};
    case Type::direction: return oneOf({Json{{"enum", {"x", "y", "z"}}}, listOf(bounded("number", key), 3)});
    case Type::autoInteger: return oneOf({Json{{"const", "auto"}}, bounded("integer", key)});
    case Type::range: return listOf(bounded("integer", key), 2);
    case Type::choices: {
        Json schema = listOf(choiceOf(key));
        schema["uniqueItems"] = true;
        return schema;
    }
    case Type::curve: return curveOf(key);
    case Type::texts: return listOf({{"type", "string"}});
    case Type::scalars: {
        Json schema = listOf({{"type", {"number", "string", "boolean"}}});
        schema["minItems"] = 1;
        return schema;
    }
    case Type::tables:
    case Type::entries: return listOf(reference(key.name));
    case Type::shape: return reference("shape");
    case Type::solid: return reference("solid");
    case Type::solids: return listOf(reference("solid"));
    case Type::motion: return reference("motion");
    case Type::anyShape: return oneOf({reference("solid"), reference("file")});
    case Type::path: return reference("path");
    case Type::poses: {
        Json schema = listOf(reference("pose"));
        schema["minItems"] = 1;
        return schema;
    }
    }
    return Json::object();
}

Json keySchema(const Key& key)
{
    const std::string unit = key.unit;
    // Beside a "$ref", draft-07 ignores all else; hence allOf.
    Json schema = isPart(key) ? Json{{"allOf", Json::array({typeSchema(key)})}} : typeSchema(key);
    schema["description"] = key.doc + (unit.empty() ? "" : " [" + unit + "]");
    if (const std::string text = defaultTextOf(key); !text.empty())
        schema["default"] = std::visit(ToJson{}, parseValue(text).value);
    return schema;
}

Json tableSchema(const TableSpec& spec)
{
    Json properties = Json::object();
    Json required = Json::array();
    for (const Key& key : spec.keys) {
        properties[key.name] = keySchema(key);
        if (key.isRequired()) required.push_back(key.name);
    }
    Json schema = {{"type", "object"}, {"description", spec.doc}, {"properties", properties}};
    if (!required.empty()) schema["required"] = required;
    schema["additionalProperties"] = false;
    return schema;
}

/// A table with `name` as its only key.
Json only(const char* name, Json value)
{
    return {{"type", "object"},
            {"properties", {{name, std::move(value)}}},
            {"required", Json::array({name})},
            {"additionalProperties", false}};
}

Json fileSchema(const TableSpec& spec) { return only(spec.name, oneOf({Json{{"type", "string"}}, tableSchema(spec)})); }

/// Those of inner tables that a vocabulary brings.
void addDefinitions(const TableSpec& spec, Json& definitions)
{
    for (const Key& key : spec.keys) {
        if (!key.table) continue;
        definitions[key.name] = tableSchema(*key.table);
        addDefinitions(*key.table, definitions);
    }
}

Json definitions(const Vocabulary& vocabulary)
{
    Json solids = Json::array();
    Json shapes = Json::array();
    for (const TableSpec& spec : tables::solids()) {
        solids.push_back(only(spec.name, tableSchema(spec)));
        if (std::string(spec.name) != "halfspace") shapes.push_back(solids.back());
    }
    Json files = Json::array();
    for (const TableSpec* spec : {&tables::meshFile(), &tables::vdbFile()}) files.push_back(fileSchema(*spec));
    shapes.insert(shapes.end(), files.begin(), files.end());
    Json motions = Json::array(), paths = Json::array();
    for (const TableSpec& spec : tables::motions()) {
        motions.push_back(tableSchema(spec));
        if (motions.size() <= std::variant_size_v<Path>) paths.push_back(motions.back());
    }
    Json all = {{"solid", {{"oneOf", solids}}}, {"shape", {{"oneOf", shapes}}}, {"motion", {{"oneOf", motions}}},
                {"file", {{"oneOf", files}}},   {"path", {{"oneOf", paths}}},   {"pose", tableSchema(tables::pose())}};
    for (const TableSpec& spec : vocabulary.all()) addDefinitions(spec, all);
    return all;
}

Json sectionSchema(const tables::Section& section)
{
    Json table = tableSchema(section.spec);
    if (section.form == tables::Section::Form::single) return table;
    if (section.form == tables::Section::Form::byName)
        return {{"type", "object"}, {"additionalProperties", std::move(table)}};
    Json list = listOf(std::move(table));
    if (section.required) list["minItems"] = 1;
    return list;
}

}  // namespace

std::string schemaText(const Vocabulary& vocabulary)
{
    Json schema = {{"$schema", "http://json-schema.org/draft-07/schema#"}, {"title", "vdbfrac scene"}};
    schema.update(tableSchema(tables::root()));
    schema["description"] = "A scene: SI units, y up.";
    Json& properties = schema["properties"];
    const tables::Output output(vocabulary);
    for (const tables::Section& section : tables::sections(output, vocabulary)) {
        properties[section.spec.name] = sectionSchema(section);
        if (section.required) schema["required"].push_back(section.spec.name);
    }
    for (const TableSpec& spec : vocabulary.all()) properties[spec.name] = tableSchema(spec);
    schema["definitions"] = definitions(vocabulary);
    return schema.dump(2) + "\n";
}

}  // namespace vdbfrac::scene
