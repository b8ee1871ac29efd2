#include "parts_text.h"

#include "complaints.h"
#include "tables.h"

#include <vdbfrac/base/error.h>

namespace vdbfrac::scene {

namespace {

std::filesystem::path absolutePath(const std::filesystem::path& file)
{
    std::error_code none;
    const std::filesystem::path absolute = std::filesystem::absolute(file, none);
    return none ? file : absolute;
}

template <class S>
std::string inlineTable(const TableSpec& spec, const S& object, const PartTexts& parts = {})
{
    return scene::inlineTable(spec, valuesOf(object, spec.keys), parts);
}

/// { kind = { ... } }
template <class S>
std::string wrapped(const TableSpec& spec, const S& object)
{
    return "{ " + std::string(spec.name) + " = " + inlineTable(spec, object) + " }";
}

std::string solidText(const Primitive& solid)
{
    const auto kind = std::size_t(solid.kind);
    if (kind >= tables::solids().size())
        throw InputError({"shape", "kind " + std::to_string(kind) + " is no solid", "", ""});
    return wrapped(tables::solids()[kind], solid);
}

std::string solidsText(const std::vector<Primitive>& solids)
{
    std::vector<std::string> texts;
    for (const Primitive& s : solids) texts.push_back(solidText(s));
    return "[" + joined(texts) + "]";
}

struct ShapeText {
    std::string operator()(const Primitive& solid) const { return solidText(solid); }
    std::string operator()(MeshFile mesh) const
    {
        mesh.file = absolutePath(mesh.file);
        return wrapped(tables::meshFile(), mesh);
    }
    std::string operator()(VdbFile vdb) const
    {
        vdb.file = absolutePath(vdb.file);
        return wrapped(tables::vdbFile(), vdb);
    }
};

std::string posesText(const std::vector<PoseKey>& keys)
{
    std::vector<std::string> texts;
    for (const PoseKey& k : keys) texts.push_back(inlineTable(tables::pose(), k));
    return "[" + joined(texts) + "]";
}

struct MotionText {
    const TableSpec& spec;

    template <class Motion>
    std::string operator()(const Motion& m) const
    {
        return inlineTable(spec, m);
    }
    std::string operator()(const Keys& m) const { return inlineTable(spec, m, {{"keys", posesText(m.keys)}}); }
};

}  // namespace

PartTexts partTexts(const Body& b)
{
    return {{"shape", std::visit(ShapeText{}, b.shape)}, {"add", solidsText(b.add)}, {"cut", solidsText(b.cut)}};
}

PartTexts partTexts(const Collider& c)
{
    const TableSpec& motion = tables::motions()[c.move.index()];
    return {{"shape", std::visit(ShapeText{}, c.shape)}, {"move", std::visit(MotionText{motion}, c.move)}};
}

PartTexts partTexts(const Grip& g)
{
    const TableSpec& motion = tables::motions()[g.move.index()];
    return {{"region", solidText(g.region)}, {"move", std::visit(MotionText{motion}, g.move)}};
}

}  // namespace vdbfrac::scene
