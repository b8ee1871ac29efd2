#include <vdbfrac/tetmesh/cache_files.h>

#include "text_writer.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/tetmesh/mtl_file.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <set>

namespace vdbfrac::tetmesh {

namespace {

constexpr int kDigits = 9;  // more than a float holds

/// A file that grows piece by piece.
class Stream {
public:
    explicit Stream(const std::filesystem::path& file) : name_(file.string()), out_(file, std::ios::binary) {}
    void add(const TextWriter& text)
    {
        out_.write(text.text().data(), std::streamsize(text.text().size()));
        if (!out_) throw FileError(name_, "cannot be written");
    }
    void end()
    {
        out_.close();
        if (!out_) throw FileError(name_, "cannot be written");
    }

private:
    std::string name_;
    std::ofstream out_;
};

/// Of each of `all` its place among those that are used; kNone: it is not.
std::vector<std::uint32_t> placesOf(std::size_t all, std::span<const std::uint32_t> used)
{
    std::vector<std::uint32_t> place(all, RenderMesh::kNone);
    std::uint32_t count = 0;
    for (std::uint32_t i : used) place[i] = count++;
    return place;
}

void addVectors(TextWriter& out, std::span<const Vec3> vectors)
{
    out << "[";
    for (std::size_t i = 0; i < vectors.size(); ++i) {
        const Vec3& v = vectors[i];
        out << (i > 0 ? ", (" : "(") << v.x() << ", " << v.y() << ", " << v.z() << ")";
    }
    out << "]";
}

template <class Value>
void addList(TextWriter& out, std::string_view name, std::size_t count, const Value& value)
{
    out << "        " << name << " = [";
    for (std::size_t i = 0; i < count; ++i) out << (i > 0 ? ", " : "") << value(i);
    out << "]";
}

/// What of a mesh does not change.
void addTopology(TextWriter& out, const DrawnTopology& drawn)
{
    const RenderMesh& mesh = drawn.mesh;
    const std::vector<std::uint32_t> number = placesOf(mesh.points.size(), usedPoints(mesh));
    out << "        uniform token subdivisionScheme = \"none\"\n";
    addList(out, "int[] faceVertexCounts", mesh.faces(), [&](std::size_t f) { return mesh.face(f).size(); });
    out << "\n";
    addList(out, "int[] faceVertexIndices", mesh.corners.size(),
            [&](std::size_t c) { return number[mesh.corners[c].point]; });
    out << "\n";
    addList(out, "int[] primvars:fragment", mesh.faces(), [&](std::size_t f) { return drawn.fragment[f]; });
    out << " (\n            interpolation = \"uniform\"\n        )\n";
    addList(out, "int[] primvars:torn", mesh.faces(), [&](std::size_t f) { return int(drawn.torn[f]); });
    out << " (\n            interpolation = \"uniform\"\n        )\n";
    std::vector<Vec3> rest;
    for (std::uint32_t p : usedPoints(mesh)) rest.push_back(mesh.points[p]);
    out << "        point3f[] primvars:rest = ";
    addVectors(out, rest);
    out << " (\n            interpolation = \"vertex\"\n        )\n";
    if (mesh.uvs.empty()) return;
    out << "        texCoord2f[] primvars:st = [";
    for (std::size_t c = 0; c < mesh.corners.size(); ++c) {
        const std::uint32_t uv = mesh.corners[c].uv;
        const Vec3 at = uv == RenderMesh::kNone ? Vec3(Vec3::Zero()) : mesh.uvs[uv];
        out << (c > 0 ? ", (" : "(") << at.x() << ", " << at.y() << ")";
    }
    out << "] (\n            interpolation = \"faceVarying\"\n        )\n";
}

/// Which corner has which normal, where all have one.
void addNormals(TextWriter& out, const RenderMesh& mesh)
{
    const std::vector<std::uint32_t> used = usedNormals(mesh);
    if (used.empty()) return;
    const std::vector<std::uint32_t> place = placesOf(mesh.normals.size(), used);
    out << "        normal3f[] primvars:normals (\n            interpolation = \"faceVarying\"\n        )\n";
    addList(out, "int[] primvars:normals:indices", mesh.corners.size(),
            [&](std::size_t c) { return place[mesh.corners[c].normal]; });
    out << "\n";
}

/// Names as USD takes them, no two alike.
class Identifiers {
public:
    std::string add(const std::string& name)
    {
        std::string id = name;
        for (char& c : id)
            if (!((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'))) c = '_';
        if (id.empty() || (id[0] >= '0' && id[0] <= '9')) id = "_" + id;
        while (!taken_.insert(id).second) id += "_";
        return id;
    }

private:
    std::set<std::string> taken_;
};

const std::string kMaterials = "/World/materials/";

/// Materials of all bodies, with their names in the file.
using MaterialNames = std::map<std::string, std::string, std::less<>>;

MaterialNames materialNames(std::span<const DrawnTopology* const> bodies)
{
    MaterialNames names;
    for (const DrawnTopology* body : bodies)
        for (std::size_t f = 0; f < body->mesh.faces(); ++f)
            if (const auto name = materialOf(*body, f); !names.contains(name)) names.emplace(name, "");
    Identifiers taken;
    for (auto& [name, id] : names) id = taken.add(name);
    return names;
}

void addSubsets(TextWriter& out, const DrawnTopology& drawn, const MaterialNames& names)
{
    out << "        uniform token subsetFamily:materialBind:familyType = \"partition\"\n";
    std::map<std::string_view, std::vector<std::size_t>> facesOf;
    for (std::size_t f = 0; f < drawn.mesh.faces(); ++f) facesOf[materialOf(drawn, f)].push_back(f);
    for (const auto& [material, faces] : facesOf) {
        const std::string& name = names.find(material)->second;
        out << "        def GeomSubset \"" << name
            << "\" (\n            prepend apiSchemas = [\"MaterialBindingAPI\"]\n"
            << "        )\n        {\n            uniform token elementType = \"face\"\n"
            << "            uniform token familyName = \"materialBind\"\n    ";
        addList(out, "int[] indices", faces.size(), [&](std::size_t i) { return faces[i]; });
        out << "\n            rel material:binding = <" << kMaterials << name << ">\n        }\n";
    }
}

/// Shaders that give a surface the colours of a texture. `at`: the path of the material.
/// `tint`: light that the texture is multiplied by, as renderers do with colours of .mtl files.
void addTexture(TextWriter& out, const std::string& at, const DiffuseMap& map, const Vec3& tint)
{
    const char* const mark = map.file.find('@') == std::string::npos ? "@" : "@@@";  // ends a path in USD
    out << "            def Shader \"st\"\n            {\n                uniform token info:id = "
           "\"UsdPrimvarReader_float2\"\n                string inputs:varname = \"st\"\n"
        << "                float2 outputs:result\n            }\n            def Shader \"place\"\n            {\n"
        << "                uniform token info:id = \"UsdTransform2d\"\n                float2 inputs:in.connect = <"
        << at << "/st.outputs:result>\n                float2 inputs:scale = (" << map.scale.x() << ", "
        << map.scale.y() << ")\n                float2 inputs:translation = (" << map.offset.x() << ", "
        << map.offset.y()
        << ")\n                float2 outputs:result\n            }\n            def Shader \"texture\"\n            "
           "{\n"
        << "                uniform token info:id = \"UsdUVTexture\"\n                asset inputs:file = " << mark
        << map.file << mark << "\n                float4 inputs:scale = (" << tint.x() << ", " << tint.y() << ", "
        << tint.z() << ", 1)"
        << "\n                token inputs:wrapS = \"repeat\"\n                token inputs:wrapT = \"repeat\"\n"
        << "                float2 inputs:st.connect = <" << at << "/place.outputs:result>\n"
        << "                float3 outputs:rgb\n            }\n";
}

void addMaterials(TextWriter& out, const MaterialNames& names, const std::string& mtl)
{
    const std::string library = mtlText(mtl);
    const std::map<std::string, Vec3> colours = diffuseColours(library);
    const std::map<std::string, DiffuseMap> maps = diffuseMaps(library);
    out << "    def Scope \"materials\"\n    {\n";
    for (const auto& [name, id] : names) {
        const std::string at = kMaterials + id;
        const auto map = maps.find(name);
        const auto own = colours.find(name);
        const Vec3 colour = lightOf(own != colours.end() ? own->second : colours.at("outside"));
        out << "        def Material \"" << id << "\"\n        {\n            token outputs:surface.connect = <" << at
            << "/shader.outputs:surface>\n            def Shader \"shader\"\n            {\n"
            << "                uniform token info:id = \"UsdPreviewSurface\"\n                color3f "
               "inputs:diffuseColor";
        if (map != maps.end())
            out << ".connect = <" << at << "/texture.outputs:rgb>";
        else
            out << " = (" << colour.x() << ", " << colour.y() << ", " << colour.z() << ")";
        out << "\n                float inputs:roughness = 0.6\n                token outputs:surface\n            }\n";
        if (map != maps.end()) addTexture(out, at, map->second, own != colours.end() ? colour : Vec3(Vec3::Ones()));
        out << "        }\n";
    }
    out << "    }\n";
}

void addSamples(TextWriter& out, const char* name, const std::vector<std::vector<Vec3>>& samples, int firstFrame)
{
    out << "        " << name << ".timeSamples = {\n";
    for (std::size_t f = 0; f < samples.size(); ++f) {
        out << "            " << firstFrame + int(f) << ": ";
        addVectors(out, samples[f]);
        out << ",\n";
    }
    out << "        }\n";
}

/// Lower and upper corner of the box round each sample, as renderers ask for it.
std::vector<std::vector<Vec3>> extentsOf(const std::vector<std::vector<Vec3>>& samples)
{
    std::vector<std::vector<Vec3>> extents;
    for (const std::vector<Vec3>& points : samples) {
        if (points.empty()) return {};
        Vec3 lower = points[0], upper = points[0];
        for (const Vec3& p : points) lower = lower.cwiseMin(p), upper = upper.cwiseMax(p);
        extents.push_back({lower, upper});
    }
    return extents;
}

}  // namespace

void writeMdd(const std::filesystem::path& file, std::span<const double> times, std::size_t points,
              const CacheFrames& frames)
{
    constexpr auto kBig = std::endian::big;
    writeAtomically(
        file,
        [&](const std::filesystem::path& temporary) {
            Stream out(temporary);
            TextWriter head;
            head.bytes<kBig>(std::int32_t(times.size()));
            head.bytes<kBig>(std::int32_t(points));
            for (double t : times) head.bytes<kBig>(float(t));
            out.add(head);
            for (std::size_t f = 0; f < times.size(); ++f) {
                TextWriter text;
                for (const CacheFrame& body : frames(f))
                    for (const Vec3& p : body.points)
                        for (int k = 0; k < 3; ++k) text.bytes<kBig>(float(p[k]));
                out.add(text);
            }
            out.end();
        },
        [&](const std::filesystem::path& temporary) {
            const std::uintmax_t size = 8 + 4 * times.size() + 12 * points * times.size();
            if (std::filesystem::file_size(temporary) != size) throw FileError(temporary.string(), "was cut off");
        });
}

void writeUsda(const std::filesystem::path& file, const UsdScene& scene, std::span<const DrawnTopology* const> bodies,
               std::size_t frames, const CacheFrames& give)
{
    std::vector<std::vector<std::vector<Vec3>>> points(bodies.size()), velocities(bodies.size()),
        normals(bodies.size());
    for (std::size_t f = 0; f < frames; ++f) {
        std::vector<CacheFrame> frame = give(f);
        for (std::size_t b = 0; b < bodies.size(); ++b) {
            points[b].push_back(std::move(frame[b].points));
            velocities[b].push_back(std::move(frame[b].velocities));
            normals[b].push_back(std::move(frame[b].normals));
        }
    }
    writeAtomically(file, [&](const std::filesystem::path& temporary) {
        Stream out(temporary);
        TextWriter head{kDigits};
        head << "#usda 1.0\n(\n    defaultPrim = \"World\"\n    startTimeCode = " << scene.firstFrame
             << "\n    endTimeCode = " << scene.firstFrame + int(frames) - 1
             << "\n    timeCodesPerSecond = " << scene.fps << "\n    framesPerSecond = " << scene.fps
             << "\n    metersPerUnit = 1\n    upAxis = \"Y\"\n)\n\n"
             << "def Xform \"World\" (\n    kind = \"component\"\n)\n{\n";
        const MaterialNames materials = materialNames(bodies);
        addMaterials(head, materials, scene.materials);
        out.add(head);
        Identifiers names;
        names.add("materials");
        for (std::size_t b = 0; b < bodies.size(); ++b) {
            TextWriter text{kDigits};
            text << "    def Mesh \"" << names.add(scene.names[b])
                 << "\" (\n        prepend apiSchemas = [\"MaterialBindingAPI\"]\n    )\n    {\n";
            addTopology(text, *bodies[b]);
            addNormals(text, bodies[b]->mesh);
            addSamples(text, "point3f[] points", points[b], scene.firstFrame);
            addSamples(text, "vector3f[] velocities", velocities[b], scene.firstFrame);
            if (!normals[b].front().empty())
                addSamples(text, "normal3f[] primvars:normals", normals[b], scene.firstFrame);
            addSamples(text, "float3[] extent", extentsOf(points[b]), scene.firstFrame);
            addSubsets(text, *bodies[b], materials);
            text << "    }\n";
            out.add(text);
        }
        TextWriter tail;
        tail << "}\n";
        out.add(tail);
        out.end();
    });
}

}  // namespace vdbfrac::tetmesh
