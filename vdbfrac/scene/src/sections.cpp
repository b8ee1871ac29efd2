#include "sections.h"

#include "key_text.h"
#include "study.h"
#include "tables.h"
#include "toml_text.h"

#include <iterator>
#include <set>

namespace vdbfrac::scene {

namespace {

/// Reads the document into `scene`, table by table.
class SectionReader {
    using Names = std::set<std::string>;
    static constexpr int kMostNamed = 50;

public:
    SectionReader(const Node& root, Context& context) : root_{root, ""}, table_(*root.table()), context_(context) {}

    Scene read(std::span<const TableSpec> effects)
    {
        checkTopLevel(effects);
        scene_.name = readKeys(root_, tables::root(), complaints()).text("name");
        readTime(section(tables::time()));
        readGrid(section(tables::grid()));
        readMaterials();
        readBodies();
        readGrips();
        readSolver(section(tables::solver()));
        readOutput(section(tables::output()));
        if (const Node* node = table_.find(tables::study().name))
            scene_.study = readStudy(root_.child(tables::study().name, *node), scene_, complaints());
        for (const TableSpec& spec : effects)
            if (const Node* node = table_.find(spec.name))
                scene_.effects.push_back({spec.name, readTable(root_.child(spec.name, *node), spec, complaints())});
        return std::move(scene_);
    }

private:
    Complaints& complaints() { return context_.complaints; }

    void checkTopLevel(std::span<const TableSpec> effects)
    {
        std::vector<std::string> known = tables::namesOf(tables::root().keys);
        for (const tables::Section& s : tables::sections()) {
            known.emplace_back(s.spec.name);
            if (s.required && !table_.find(s.spec.name)) complainMissing(s);
        }
        for (const TableSpec& effect : effects) known.emplace_back(effect.name);
        checkUnknown(root_, known, complaints());
    }

    void complainMissing(const tables::Section& s)
    {
        const std::string name = s.spec.name;
        const bool list = s.form == tables::Section::Form::list;
        complaints().add(root_.node.place,
                         {"the scene lacks a table " + (list ? "[[" + name + "]]" : "[" + name + "]"), "", s.spec.doc});
    }

    /// Values of a single table; of an empty one when it is missing. A missing required one has been complained about.
    Values section(const TableSpec& spec)
    {
        if (const Node* node = table_.find(spec.name))
            return readTable(root_.child(spec.name, *node), spec, complaints());
        Complaints unheard("", {});
        const Node none{{}, Table{}};
        return readTable({none, spec.name}, spec, unheard);
    }

    void readTime(const Values& v)
    {
        const auto [first, last] = v.range("frames");
        scene_.time = {int(first),           int(last),
                       v.number("fps"),      int(v.integer("substeps")),
                       v.number("node_cfl"), v.number("front_cfl")};
    }

    void readGrid(const Values& v)
    {
        const LatticeKind lattice = v.text("lattice") == "five"       ? LatticeKind::five
                                    : v.text("lattice") == "delaunay" ? LatticeKind::delaunay
                                                                      : LatticeKind::six;
        scene_.grid = {v.number("voxel_size"),       lattice,
                       int(v.integer("coarsening")), int(v.integer("half_width")),
                       v.number("grading"),          v.text("surface") == "whole_tets"};
    }

    void readSolver(const Values& v)
    {
        scene_.solver = {v.text("integrator"),
                         v.text("strain"),
                         v.text("tangent"),
                         v.number("newton_tolerance"),
                         int(v.integer("newton_iterations")),
                         v.text("linear_solver"),
                         v.number("linear_tolerance"),
                         int(v.integer("linear_iterations")),
                         v.text("precision"),
                         v.text("volumetric") == "cell"};
    }

    void readOutput(const Values& v) { scene_.output = {v.list("vdb"), v.boolean("obj")}; }

    void readMaterials()
    {
        const TableSpec& spec = tables::material();
        const Node* node = table_.find(spec.name);
        if (!node) return;
        const Item all = root_.child(spec.name, *node);
        if (!node->table()) return complainType(all, "tables [material.NAME]", complaints());
        for (const Member& m : node->table()->members) {
            const Values v = readTable(all.child(keyText(m.key), m.value), spec, complaints());
            materialNames_.insert(m.key);
            scene_.materials.push_back(
                {m.key, v.number("youngs_modulus"), v.number("poisson_ratio"), v.number("density")});
        }
    }

    /// Calls read(item) for each table of a list [[name]].
    template <class Read>
    void forEach(const TableSpec& spec, const Read& read)
    {
        const Node* node = table_.find(spec.name);
        if (!node) return;
        const Item all = root_.child(spec.name, *node);
        const Array* array = node->array();
        const std::string header = "[[" + std::string(spec.name) + "]]";
        if (!array) return complainType(all, "tables " + header, complaints());
        for (std::size_t i = 0; i < array->items.size(); ++i) read(all.child(std::to_string(i), array->items[i]));
    }

    void readBodies()
    {
        const Node* node = table_.find("body");
        if (node && node->array() && node->array()->items.empty())
            complainType(root_.child("body", *node), "at least one table [[body]]", complaints());
        forEach(tables::body(), [&](const Item& item) { readBody(item); });
    }

    void readBody(const Item& item)
    {
        const Values v = readTable(item, tables::body(), complaints());
        Body body;
        body.name = v.text("name");
        body.material = v.text("material");
        body.velocity = v.vector("velocity");
        body.angularVelocity = v.vector("angular_velocity");
        body.place = complaints().placeText(item.node.place);
        if (const Node* shape = member(item, "shape")) body.shape = readShape(item.child("shape", *shape), context_);
        if (const Node* add = member(item, "add")) body.add = readSolids(item.child("add", *add), true, context_);
        if (const Node* cut = member(item, "cut")) body.cut = readSolids(item.child("cut", *cut), false, context_);
        checkNew(item, bodyNames_);
        checkReference(item, "material", materialNames_);
        bodyNames_.insert(body.name);
        scene_.bodies.push_back(std::move(body));
    }

    void readGrips()
    {
        forEach(tables::grip(), [&](const Item& item) { readGrip(item); });
    }

    void readGrip(const Item& item)
    {
        const Values v = readTable(item, tables::grip(), complaints());
        Grip grip;
        grip.name = v.has("name") ? v.text("name") : freeGripName();
        grip.body = v.text("body");
        grip.place = complaints().placeText(item.node.place);
        if (const Node* region = member(item, "region"))
            grip.region = readSolid(item.child("region", *region), context_);
        if (const Node* move = member(item, "move")) grip.move = readMotion(item.child("move", *move), context_);
        checkNew(item, gripNames_);
        checkReference(item, "body", bodyNames_);
        gripNames_.insert(grip.name);
        scene_.grips.push_back(std::move(grip));
    }

    std::string freeGripName() const
    {
        std::size_t number = scene_.grips.size() + 1;
        while (gripNames_.count("grip" + std::to_string(number))) ++number;
        return "grip" + std::to_string(number);
    }

    static const Node* member(const Item& item, const char* key)
    {
        return item.node.table() ? item.node.table()->find(key) : nullptr;
    }

    /// The name given must not be among those of the tables before.
    void checkNew(const Item& item, const Names& taken)
    {
        const Node* name = member(item, "name");
        if (!name || !name->text() || !taken.count(*name->text())) return;
        complaints().add(name->place, {item.path + ".name is " + describe(*name) + ", which is taken",
                                       "a name that no table before has"});
    }

    /// The name given must be one of `names`.
    void checkReference(const Item& item, const char* key, const Names& known)
    {
        const Node* given = member(item, key);
        if (!given || !given->text() || known.count(*given->text())) return;
        // A list of thousands helps nobody, and comparing with each takes its time.
        const auto end = known.size() > kMostNamed ? std::next(known.begin(), kMostNamed) : known.end();
        const std::vector<std::string> names(known.begin(), end);
        const std::string allowed = names.empty() ? "there is no " + std::string(key) : "one of " + joined(names);
        complaints().add(given->place, {"unknown " + std::string(key) + " " + describe(*given) + " in " + item.path,
                                        allowed, didYouMean(*given->text(), names)});
    }

    Item root_;
    const Table& table_;
    Context& context_;
    Scene scene_;
    Names materialNames_, bodyNames_, gripNames_;
};

}  // namespace

Scene readSections(const Node& root, std::span<const TableSpec> effects, Context& context)
{
    return SectionReader(root, context).read(effects);
}

}  // namespace vdbfrac::scene
