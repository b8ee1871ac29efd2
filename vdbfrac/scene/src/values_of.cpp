#include "values_of.h"

#include "tables.h"
#include "toml_text.h"

namespace vdbfrac::scene {

namespace {

Values valuesOf(std::initializer_list<std::pair<const char*, Values::Value>> pairs)
{
    Values values;
    for (const auto& [key, value] : pairs) values.set(key, value);
    return values;
}

std::string absolutePath(const std::filesystem::path& file)
{
    std::error_code none;
    const std::filesystem::path absolute = std::filesystem::absolute(file, none);
    return (none ? file : absolute).string();
}

std::string wrapped(const std::string& key, const std::string& value) { return "{ " + key + " = " + value + " }"; }

std::string solidText(const Primitive& s)
{
    // All that any kind has; the spec of the kind takes its own.
    const Values values = valuesOf({{"center", s.center},
                                    {"size", s.size},
                                    {"axis", s.axis},
                                    {"normal", s.axis},
                                    {"radius", s.radius},
                                    {"height", s.height},
                                    {"tube", s.tube},
                                    {"offset", s.offset}});
    const TableSpec& spec = tables::solids()[std::size_t(s.kind)];
    return wrapped(spec.name, inlineTable(spec, {values}));
}

std::string solidsText(const std::vector<Primitive>& solids)
{
    std::string text;
    for (const Primitive& s : solids) text += (text.empty() ? "" : ", ") + solidText(s);
    return "[" + text + "]";
}

struct ShapeText {
    std::string operator()(const Primitive& solid) const { return solidText(solid); }
    std::string operator()(const MeshFile& m) const
    {
        const Values values = valuesOf(
            {{"file", absolutePath(m.file)}, {"scale", m.scale}, {"rotate", m.rotate}, {"translate", m.translate}});
        return wrapped("mesh", inlineTable(tables::meshFile(), {values}));
    }
    std::string operator()(const VdbFile& v) const
    {
        return wrapped("vdb",
                       inlineTable(tables::vdbFile(), {valuesOf({{"file", absolutePath(v.file)}, {"grid", v.grid}})}));
    }
};

std::string posesText(const std::vector<PoseKey>& keys)
{
    std::string text;
    for (const PoseKey& k : keys) {
        const Values values = valuesOf({{"time", k.time}, {"translate", k.translate}, {"rotate", k.rotate}});
        text += (text.empty() ? "" : ", ") + inlineTable(tables::pose(), {values});
    }
    return "[" + text + "]";
}

struct MotionContent {
    Content operator()(const Velocity& m) const { return {valuesOf({{"velocity", m.velocity}})}; }
    Content operator()(const Keys& m) const { return {valuesOf({{"pivot", m.pivot}}), {{"keys", posesText(m.keys)}}}; }
    Content operator()(const Force& m) const { return {valuesOf({{"force", m.force}, {"ramp", m.ramp}})}; }
};

}  // namespace

Content contentOfRoot(const Scene& s) { return {valuesOf({{"version", 1LL}, {"name", s.name}})}; }

Content contentOf(const Time& t)
{
    return {valuesOf({{"frames", Values::Range(t.firstFrame, t.lastFrame)},
                      {"fps", t.fps},
                      {"substeps", static_cast<long long>(t.substeps)},
                      {"node_cfl", t.nodeCfl},
                      {"front_cfl", t.frontCfl}})};
}

std::string nameOf(LatticeKind lattice)
{
    switch (lattice) {
    case LatticeKind::six: return "six";
    case LatticeKind::five: return "five";
    default: return "delaunay";
    }
}

Content contentOf(const Grid& g)
{
    return {valuesOf({{"voxel_size", g.voxelSize},
                      {"lattice", nameOf(g.lattice)},
                      {"coarsening", static_cast<long long>(g.coarsening)},
                      {"half_width", static_cast<long long>(g.halfWidth)},
                      {"grading", g.grading},
                      {"surface", std::string(g.wholeTets ? "whole_tets" : "cut_planes")}})};
}

Content contentOf(const Body& b)
{
    return {valuesOf({{"name", b.name},
                      {"material", b.material},
                      {"velocity", b.velocity},
                      {"angular_velocity", b.angularVelocity}}),
            {{"shape", std::visit(ShapeText{}, b.shape)}, {"add", solidsText(b.add)}, {"cut", solidsText(b.cut)}}};
}

Content contentOf(const Material& m)
{
    return {valuesOf({{"youngs_modulus", m.youngsModulus}, {"poisson_ratio", m.poissonRatio}, {"density", m.density}})};
}

Content contentOf(const Grip& g)
{
    const TableSpec& motion = tables::motions()[g.move.index()];
    return {valuesOf({{"name", g.name}, {"body", g.body}}),
            {{"region", solidText(g.region)}, {"move", inlineTable(motion, std::visit(MotionContent{}, g.move))}}};
}

Content contentOf(const Solver& s)
{
    return {valuesOf({{"integrator", s.integrator},
                      {"strain", s.strain},
                      {"tangent", s.tangent},
                      {"newton_tolerance", s.newtonTolerance},
                      {"newton_iterations", static_cast<long long>(s.newtonIterations)},
                      {"linear_solver", s.linearSolver},
                      {"linear_tolerance", s.linearTolerance},
                      {"linear_iterations", static_cast<long long>(s.linearIterations)},
                      {"precision", s.precision},
                      {"volumetric", std::string(s.cellDilation ? "cell" : "none")}})};
}

Content contentOf(const Output& o) { return {valuesOf({{"vdb", o.vdb}, {"obj", o.obj}})}; }

Content contentOf(const Study& s)
{
    return {valuesOf({{"about", s.about}, {"rounds", static_cast<long long>(s.rounds)}})};
}

Content contentOf(const Study::Series& s)
{
    Content content{
        valuesOf({{"name", s.name}, {"set", s.set}, {"key", s.key}, {"values", s.values}, {"refines", s.refines}})};
    if (s.order) content.values.set("order", *s.order);
    std::string tied;
    for (const Study::Tied& t : s.tied)
        tied += (tied.empty() ? "" : ", ") +
                inlineTable(tables::tied(), {valuesOf({{"key", t.key}, {"values", t.values}})});
    content.parts["tied"] = "[" + tied + "]";
    return content;
}

Content contentOf(const Study::Measure& m)
{
    Content content{valuesOf({{"name", m.name}, {"quantity", m.quantity}, {"source", m.source}})};
    Values& v = content.values;
    if (!m.body.empty()) v.set("body", m.body);
    if (!m.grip.empty()) v.set("grip", m.grip);
    if (m.point) v.set("point", *m.point);
    if (m.axis) v.set("axis", *m.axis);
    if (m.rest) v.set("rest", *m.rest);
    if (m.wavelength) v.set("wavelength", *m.wavelength);
    if (m.exact) v.set("exact", *m.exact);
    if (m.scale) v.set("scale", *m.scale);
    if (m.order) v.set("order", *m.order);
    return content;
}

std::string inlineTable(const TableSpec& spec, const Content& content)
{
    std::string text;
    for (const Key& key : spec.keys) {
        const auto part = content.parts.find(key.name);
        const bool isPart = part != content.parts.end();
        if (!isPart && !content.values.has(key.name)) continue;
        const std::string value = isPart ? part->second : valueText(content.values.all().at(key.name), key.type);
        text += (text.empty() ? "" : ", ") + keyText(key.name) + " = " + value;
    }
    return "{ " + text + " }";
}

}  // namespace vdbfrac::scene
