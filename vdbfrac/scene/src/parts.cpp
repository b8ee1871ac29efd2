#include "parts.h"

#include "tables.h"

#include <algorithm>

namespace vdbfrac::scene {

namespace {

/// Values that a kind of solid lacks keep the defaults of Primitive.
Primitive solidOf(Primitive::Kind kind, const Values& v)
{
    Primitive solid;
    solid.kind = kind;
    if (v.has("center")) solid.center = v.vector("center");
    if (v.has("size")) solid.size = v.vector("size");
    if (v.has("axis")) solid.axis = v.vector("axis");
    if (v.has("normal")) solid.axis = v.vector("normal");
    if (v.has("radius")) solid.radius = v.number("radius");
    if (v.has("height")) solid.height = v.number("height");
    if (v.has("tube")) solid.tube = v.number("tube");
    if (v.has("offset")) solid.offset = v.number("offset");
    return solid;
}

/// Which of the specs has this name; one of them must.
std::size_t indexOf(const std::string& name, std::span<const TableSpec> specs)
{
    const auto it = std::find_if(specs.begin(), specs.end(), [&](const TableSpec& s) { return name == s.name; });
    return std::size_t(it - specs.begin());
}

/// The solid of a table { kind = {...} } of which `member` is the only one.
Primitive readMember(const Item& item, const Member& member, Context& context)
{
    const auto specs = tables::solids();
    const std::size_t kind = indexOf(member.key, specs);
    const Values values = readTable(item.child(member.key, member.value), specs[kind], context.complaints);
    return solidOf(Primitive::Kind(kind), values);
}

void checkBounded(const Item& item, const Primitive& solid, Context& context)
{
    if (solid.kind == Primitive::Kind::halfspace)
        context.complaints.add(item.node.place, {item.path + " is endless", "a bounded solid",
                                                 "a halfspace can be in cut and in the region of a grip"});
    if (solid.kind == Primitive::Kind::cylinder && solid.height == 0)
        context.complaints.add(item.node.place,
                               {item.path + " is endless", "a bounded solid", "give the cylinder a height"});
}

std::filesystem::path resolve(const Item& item, const std::string& file, Context& context)
{
    if (file.empty() || file.find('\0') != std::string::npos) {
        complainType(item, "the name of a file", context.complaints);
        return {};
    }
    return (context.folder / file).lexically_normal();
}

/// The text `mesh = "x.obj"`, short for `mesh = { file = "x.obj" }`, as that table.
Node asFileTable(const Node& node)
{
    if (!node.text()) return node;
    return {node.place, Table{{Member{"file", node.place, node}}}};
}

/// What `file` stands for; a missing or wrong one has been complained about.
std::filesystem::path readFile(const Item& table, const Values& values, Context& context)
{
    const Table* members = table.node.table();
    const Node* given = members ? members->find("file") : nullptr;
    if (!given || !given->text()) return {};
    return resolve(table.child("file", *given), values.text("file"), context);
}

MeshFile readMeshFile(const Item& item, Context& context)
{
    const Node node = asFileTable(item.node);
    const Item table{node, item.path};
    const Values v = readTable(table, tables::meshFile(), context.complaints);
    return {readFile(table, v, context), v.number("scale"), v.vector("rotate"), v.vector("translate")};
}

VdbFile readVdbFile(const Item& item, Context& context)
{
    const Node node = asFileTable(item.node);
    const Item table{node, item.path};
    const Values v = readTable(table, tables::vdbFile(), context.complaints);
    return {readFile(table, v, context), v.text("grid")};
}

const Node* find(const Item& item, const char* key)
{
    const Table* table = item.node.table();
    return table ? table->find(key) : nullptr;
}

std::vector<PoseKey> readPoses(const Item& item, Context& context)
{
    std::vector<PoseKey> keys;
    const Array* array = item.node.array();
    if (!array || array->items.empty()) complainType(item, "a list of at least one pose", context.complaints);
    for (std::size_t i = 0; array && i < array->items.size(); ++i) {
        const Item entry = item.child(std::to_string(i), array->items[i]);
        const std::size_t before = context.complaints.count();
        const Values v = readTable(entry, tables::pose(), context.complaints);
        if (context.complaints.count() != before) continue;
        const PoseKey key{v.number("time"), v.vector("translate"), v.vector("rotate")};
        if (!keys.empty() && key.time <= keys.back().time) {
            const Item time = entry.child("time", *find(entry, "time"));
            complainType(time, "a time later than the key before", context.complaints);
        }
        keys.push_back(key);
    }
    return keys;
}

}  // namespace

Primitive readSolid(const Item& item, Context& context)
{
    const std::vector<std::string> kinds = tables::namesOf(tables::solids());
    const Member* member = onlyMember(item, kinds, context.complaints);
    if (!member) return {};
    checkUnknown(item, kinds, context.complaints);
    return readMember(item, *member, context);
}

std::vector<Primitive> readSolids(const Item& item, bool bounded, Context& context)
{
    std::vector<Primitive> solids;
    const Array* array = item.node.array();
    if (!array) complainType(item, "a list of solids", context.complaints);
    for (std::size_t i = 0; array && i < array->items.size(); ++i) {
        const Item entry = item.child(std::to_string(i), array->items[i]);
        const std::size_t before = context.complaints.count();
        solids.push_back(readSolid(entry, context));
        if (bounded && context.complaints.count() == before) checkBounded(entry, solids.back(), context);
    }
    return solids;
}

decltype(Body::shape) readShape(const Item& item, Context& context)
{
    std::vector<std::string> kinds = tables::namesOf(tables::solids());
    kinds.insert(kinds.end(), {"mesh", "vdb"});
    const Member* member = onlyMember(item, kinds, context.complaints);
    if (!member) return {};
    checkUnknown(item, kinds, context.complaints);
    const Item inner = item.child(member->key, member->value);
    if (member->key == "mesh") return readMeshFile(inner, context);
    if (member->key == "vdb") return readVdbFile(inner, context);
    const std::size_t before = context.complaints.count();
    const Primitive solid = readMember(item, *member, context);
    if (context.complaints.count() == before) checkBounded(inner, solid, context);
    return solid;
}

decltype(Grip::move) readMotion(const Item& item, Context& context)
{
    const auto specs = tables::motions();
    const Member* member = onlyMember(item, tables::namesOf(specs), context.complaints);
    if (!member) return {};
    const Values v = readTable(item, specs[indexOf(member->key, specs)], context.complaints);
    if (member->key == "velocity") return Velocity{v.vector("velocity")};
    if (member->key == "force") return Force{v.vector("force"), v.number("ramp")};
    return Keys{readPoses(item.child("keys", member->value), context), v.vector("pivot")};
}

}  // namespace vdbfrac::scene
