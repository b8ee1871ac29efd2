#include "sections.h"

#include "key_text.h"
#include "tables.h"
#include "toml_text.h"

#include <iterator>
#include <set>

namespace vdbfrac::scene {

namespace {

/// Reads the document into `scene`, table by table.
class SectionReader {
    using Names = std::set<std::string>;
    static constexpr int kMaxNamed = 50;

public:
    SectionReader(const Node& root, const Vocabulary& vocabulary, Context& context)
        : root_{root, ""}, table_(*root.table()), vocabulary_(vocabulary), output_(vocabulary), context_(context)
    {
    }

    Scene read()
    {
        checkTopLevel();
        fill(scene_, tables::root().keys, readKeys(root_, tables::root(), complaints()));
        readSection(tables::time(), scene_.time);
        readSection(tables::grid(), scene_.grid);
        readMaterials();
        readBodies();
        forEach(tables::grip(), [&](const Item& item) { readGrip(item); });
        if (vocabulary_.colliders) forEach(tables::collider(), [&](const Item& item) { readCollider(item); });
        readSection(tables::solver(), scene_.solver);
        readSection(output_.spec(), scene_.output);
        scene_.notes = readBrought(vocabulary_.notes);
        scene_.tables = readBrought(vocabulary_.tables);
        return std::move(scene_);
    }

private:
    Complaints& complaints() { return context_.complaints; }

    void checkTopLevel()
    {
        std::vector<std::string> known = tables::namesOf(tables::root().keys);
        for (const tables::Section& s : tables::sections(output_, vocabulary_)) {
            known.emplace_back(s.spec.name);
            if (s.required && !table_.find(s.spec.name)) complainMissing(s);
        }
        for (const TableSpec& spec : vocabulary_.all()) known.emplace_back(spec.name);
        checkUnknown(root_, known, complaints());
    }

    void complainMissing(const tables::Section& s)
    {
        const std::string name = s.spec.name;
        const bool list = s.form == tables::Section::Form::list;
        complaints().add(root_.node.place,
                         {"the scene lacks a table " + (list ? "[[" + name + "]]" : "[" + name + "]"), "", s.spec.doc});
    }

    /// A single table; an empty one when it is missing. A missing required one has been complained about.
    template <class S>
    void readSection(const TableSpec& spec, S& object)
    {
        Complaints unheard("", {});
        const Node none{{}, Table{}};
        const Node* node = table_.find(spec.name);
        readInto(object, root_.child(spec.name, node ? *node : none), spec, node ? complaints() : unheard);
    }

    std::vector<NamedValues> readBrought(const std::vector<TableSpec>& specs)
    {
        std::vector<NamedValues> tables;
        for (const TableSpec& spec : specs)
            if (const Node* node = table_.find(spec.name))
                tables.push_back(
                    {spec.name, readWithEntries(root_.child(spec.name, *node), spec, scene_, complaints())});
        return tables;
    }

    void readMaterials()
    {
        const TableSpec& spec = tables::material();
        const Node* node = table_.find(spec.name);
        if (!node) return;
        const Item all = root_.child(spec.name, *node);
        if (!node->table()) return complainType(all, "tables [material.NAME]", complaints());
        for (const KeyValue& m : node->table()->members) {
            materialNames_.insert(m.key);
            Material material;
            material.name = m.key;
            readInto(material, all.child(keyText(m.key), m.value), spec, complaints());
            if (material.hasColour() && (m.key == "inside" || m.key == "outside"))
                complaints().add(m.keyPlace,
                                 {"material." + m.key + " has a colour, but in .obj files this is the name " +
                                      "of what fracture made, or left",
                                  "another name"});
            scene_.materials.push_back(std::move(material));
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
        Body body;
        readInto(body, item, tables::body(), complaints());
        body.place = complaints().placeText(item.node.place);
        if (const Node* shape = item.member("shape")) body.shape = readShape(item.child("shape", *shape), context_);
        if (const Node* add = item.member("add")) body.add = readSolids(item.child("add", *add), true, context_);
        if (const Node* cut = item.member("cut")) body.cut = readSolids(item.child("cut", *cut), false, context_);
        checkNew(item, bodyNames_);
        checkReference(item, "material", materialNames_);
        bodyNames_.insert(body.name);
        scene_.bodies.push_back(std::move(body));
    }

    void readGrip(const Item& item)
    {
        Grip grip;
        grip.name = freeName("grip", scene_.grips.size(), gripNames_);
        readInto(grip, item, tables::grip(), complaints());
        grip.place = complaints().placeText(item.node.place);
        if (const Node* region = item.member("region"))
            grip.region = readSolid(item.child("region", *region), context_);
        if (const Node* move = item.member("move")) grip.move = readMotion(item.child("move", *move), context_);
        checkNew(item, gripNames_);
        checkReference(item, "body", bodyNames_);
        gripNames_.insert(grip.name);
        scene_.grips.push_back(std::move(grip));
    }

    void readCollider(const Item& item)
    {
        Collider collider;
        collider.name = freeName("collider", scene_.colliders.size(), colliderNames_);
        readInto(collider, item, tables::collider(), complaints());
        collider.place = complaints().placeText(item.node.place);
        if (const Node* shape = item.member("shape"))
            collider.shape = readAnyShape(item.child("shape", *shape), context_);
        if (const Node* move = item.member("move")) collider.move = readPath(item.child("move", *move), context_);
        checkNew(item, colliderNames_);
        colliderNames_.insert(collider.name);
        scene_.colliders.push_back(std::move(collider));
    }

    static std::string freeName(const std::string& kind, std::size_t before, const Names& taken)
    {
        std::size_t number = before + 1;
        while (taken.count(kind + std::to_string(number))) ++number;
        return kind + std::to_string(number);
    }

    /// The name given must not be among those of the tables before.
    void checkNew(const Item& item, const Names& taken)
    {
        const Node* name = item.member("name");
        if (!name || !name->text() || !taken.count(*name->text())) return;
        complaints().add(name->place, {item.path + ".name is " + describe(*name) + ", which is taken",
                                       "a name that no table before has"});
    }

    /// The name given must be one of `names`.
    void checkReference(const Item& item, const char* key, const Names& known)
    {
        const Node* given = item.member(key);
        if (!given || !given->text() || known.count(*given->text())) return;
        // A list of thousands helps nobody, and comparing with each takes its time.
        const auto end = known.size() > kMaxNamed ? std::next(known.begin(), kMaxNamed) : known.end();
        complainUnknown(item, key, {known.begin(), end}, complaints());
    }

    Item root_;
    const Table& table_;
    const Vocabulary& vocabulary_;
    const tables::Output output_;
    Context& context_;
    Scene scene_;
    Names materialNames_, bodyNames_, gripNames_, colliderNames_;
};

}  // namespace

Scene readSections(const Node& root, const Vocabulary& vocabulary, Context& context)
{
    return SectionReader(root, vocabulary, context).read();
}

}  // namespace vdbfrac::scene
