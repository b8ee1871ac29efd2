#include "parts.h"

#include "tables.h"

#include <algorithm>

namespace vdbfrac::scene {

namespace {

/// Which of the specs has this name; one of them must.
std::size_t indexOf(const std::string& name, std::span<const TableSpec> specs)
{
    const auto it = std::find_if(specs.begin(), specs.end(), [&](const TableSpec& s) { return name == s.name; });
    return std::size_t(it - specs.begin());
}

/// The solid of a table { kind = {...} } of which `member` is the only one.
Primitive readMember(const Item& item, const KeyValue& member, Context& context)
{
    const auto specs = tables::solids();
    const std::size_t kind = indexOf(member.key, specs);
    // Members that a kind of solid lacks keep the defaults of Primitive.
    Primitive solid;
    solid.kind = Primitive::Kind(kind);
    readInto(solid, item.child(member.key, member.value), specs[kind], context.complaints);
    return solid;
}

void checkBounded(const Item& item, const Primitive& solid, Context& context)
{
    if (solid.kind == Primitive::Kind::halfspace)
        context.complaints.add(item.node.place, {item.path + " is endless", "a bounded solid",
                                                 "a halfspace can be a collider, in cut and in the region of a grip"});
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

/// A MeshFile or a VdbFile.
template <class File>
File readFile(const Item& item, const TableSpec& spec, Context& context)
{
    const Node node = asFileTable(item.node);
    const Item table{node, item.path};
    File read;
    readInto(read, table, spec, context.complaints);
    const Node* given = table.member("file");  // a missing or wrong one has been complained about
    if (given && given->text()) read.file = resolve(table.child("file", *given), *given->text(), context);
    return read;
}

std::vector<PoseKey> readPoses(const Item& item, Context& context)
{
    std::vector<PoseKey> keys;
    const Array* array = item.node.array();
    if (!array || array->items.empty()) complainType(item, "a list of at least one pose", context.complaints);
    for (std::size_t i = 0; array && i < array->items.size(); ++i) {
        const Item entry = item.child(std::to_string(i), array->items[i]);
        const std::size_t before = context.complaints.count();
        PoseKey key;
        readInto(key, entry, tables::pose(), context.complaints);
        if (context.complaints.count() != before) continue;
        if (!keys.empty() && key.time <= keys.back().time) {
            const Item time = entry.child("time", *entry.member("time"));
            complainType(time, "a time later than the key before", context.complaints);
        }
        keys.push_back(key);
    }
    return keys;
}

}  // namespace

Node asFileTable(const Node& node)
{
    if (!node.text()) return node;
    return {node.place, Table{{KeyValue{"file", node.place, node}}}};
}

Primitive readSolid(const Item& item, Context& context)
{
    const std::vector<std::string> kinds = tables::namesOf(tables::solids());
    const KeyValue* member = onlyMember(item, kinds, context.complaints);
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

decltype(Collider::shape) readAnyShape(const Item& item, Context& context)
{
    std::vector<std::string> kinds = tables::namesOf(tables::solids());
    kinds.insert(kinds.end(), {"mesh", "vdb"});
    const KeyValue* member = onlyMember(item, kinds, context.complaints);
    if (!member) return {};
    checkUnknown(item, kinds, context.complaints);
    const Item inner = item.child(member->key, member->value);
    if (member->key == "mesh") return readFile<MeshFile>(inner, tables::meshFile(), context);
    if (member->key == "vdb") return readFile<VdbFile>(inner, tables::vdbFile(), context);
    return readMember(item, *member, context);
}

decltype(Body::shape) readShape(const Item& item, Context& context)
{
    const std::size_t before = context.complaints.count();
    const decltype(Body::shape) shape = readAnyShape(item, context);
    const Primitive* const solid = std::get_if<Primitive>(&shape);
    if (solid && context.complaints.count() == before) {
        const KeyValue& member = item.node.table()->members.front();
        checkBounded(item.child(member.key, member.value), *solid, context);
    }
    return shape;
}

namespace {

/// One of the first `kinds` motions.
decltype(Grip::move) readMotion(const Item& item, std::size_t kinds, Context& context)
{
    const auto specs = tables::motions().first(kinds);
    const KeyValue* member = onlyMember(item, tables::namesOf(specs), context.complaints);
    if (!member) return {};
    decltype(Grip::move) motion;
    if (member->key == "keys") motion = Keys{};
    if (member->key == "force") motion = Force{};
    std::visit([&](auto& m) { readInto(m, item, specs[motion.index()], context.complaints); }, motion);
    if (Keys* keyed = std::get_if<Keys>(&motion)) keyed->keys = readPoses(item.child("keys", member->value), context);
    return motion;
}

}  // namespace

decltype(Grip::move) readMotion(const Item& item, Context& context)
{
    return readMotion(item, tables::motions().size(), context);
}

Path readPath(const Item& item, Context& context)
{
    const decltype(Grip::move) motion = readMotion(item, std::variant_size_v<Path>, context);
    if (const Keys* keyed = std::get_if<Keys>(&motion)) return *keyed;
    return std::get<Velocity>(motion);
}

}  // namespace vdbfrac::scene
