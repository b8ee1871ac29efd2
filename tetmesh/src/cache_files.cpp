#include <vdbfrac/tetmesh/cache_files.h>

#include "text_writer.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/polygon.h>
#include <vdbfrac/tetmesh/mtl_file.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <set>
#include <string_view>
#include <system_error>

namespace vdbfrac::tetmesh {

namespace {

constexpr int kDigits = 9;  // more than a float holds

void requireWritten(const std::ios& stream, const std::string& name)
{
    if (!stream) throw FileError(name, "cannot be written: " + std::generic_category().message(errno));
}

/// A file that grows piece by piece.
class Stream {
public:
    explicit Stream(const std::filesystem::path& file) : name_(file.string()), out_(file, std::ios::binary) {}
    void add(const TextWriter& text) { add(text.text()); }
    void add(std::string_view text)
    {
        out_.write(text.data(), std::streamsize(text.size()));
        requireWritten(out_, name_);
    }
    void end()
    {
        out_.close();
        requireWritten(out_, name_);
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

/// Along which a face at rest is projected: what has no texture coordinates of its own gets those of a box [m].
int steepestAxis(const RenderMesh& mesh, std::size_t f)
{
    const auto corners = mesh.face(f);
    const Vec3 normal = doubleArea(corners.size(), [&](std::size_t k) { return mesh.points[corners[k].point]; });
    int axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    return axis;
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
    const char* between = "(";
    for (std::size_t f = 0; f < mesh.faces(); ++f) {
        const int axis = steepestAxis(mesh, f);
        for (const RenderMesh::Corner& corner : mesh.face(f)) {
            const bool isOwn = corner.uv != RenderMesh::kNone && !drawn.torn[f];
            const Vec3 at = isOwn ? mesh.uvs[corner.uv] : mesh.points[corner.point];
            out << between << at[isOwn ? 0 : (axis + 1) % 3] << ", " << at[isOwn ? 1 : (axis + 2) % 3] << ")";
            between = ", (";
        }
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
    const std::map<std::string, Light> lights = lightsOf(library);
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
        out << "\n                float inputs:roughness = 0.6\n";
        if (const auto light = lights.find(name); light != lights.end()) {
            const Vec3 glow = lightOf(light->second.emitted);
            out << "                float inputs:opacity = " << light->second.opacity
                << "\n                color3f inputs:emissiveColor = (" << glow.x() << ", " << glow.y() << ", "
                << glow.z() << ")\n";
        }
        out << "                token outputs:surface\n            }\n";
        if (map != maps.end()) addTexture(out, at, map->second, own != colours.end() ? colour : Vec3(Vec3::Ones()));
        out << "        }\n";
    }
    out << "    }\n";
}

/// Pieces of text on disk until they are put in order: frames come with all that is in them, a USD text has each value
/// of each body with all frames.
class Spool {
public:
    explicit Spool(std::filesystem::path file)
        : file_(std::move(file)), stream_(file_, std::ios::in | std::ios::out | std::ios::trunc | std::ios::binary)
    {
    }
    ~Spool()
    {
        std::error_code isGone;
        std::filesystem::remove(file_, isGone);
    }
    Spool(const Spool&) = delete;
    Spool& operator=(const Spool&) = delete;

    struct Piece {
        std::uint64_t begin = 0, size = 0;  // bytes
    };
    Piece add(const TextWriter& text)
    {
        const Piece piece{end_, text.text().size()};
        stream_.write(text.text().data(), std::streamsize(piece.size));
        requireWritten(stream_, file_.string());
        end_ += piece.size;
        return piece;
    }
    std::string read(const Piece& piece)
    {
        requireWritten(stream_.flush(), file_.string());
        std::string text(piece.size, '\0');
        stream_.seekg(std::streamoff(piece.begin));
        stream_.read(text.data(), std::streamsize(piece.size));
        if (!stream_) throw FileError(file_.string(), "cannot be read back");
        return text;
    }

private:
    std::filesystem::path file_;
    std::fstream stream_;
    std::uint64_t end_ = 0;
};

/// Time samples of a body: a piece a frame of each value; none where there is nothing.
struct Samples {
    static constexpr std::array kNames{"point3f[] points", "vector3f[] velocities", "normal3f[] primvars:normals",
                                       "float3[] extent"};
    std::array<std::vector<Spool::Piece>, kNames.size()> pieces;

    void add(const CacheFrame& frame, int number, Spool& spool)
    {
        std::vector<Vec3> extent;  // lower and upper corner of the box round all, as renderers ask for it
        if (!frame.points.empty()) extent.assign(2, frame.points[0]);
        for (const Vec3& p : frame.points) extent[0] = extent[0].cwiseMin(p), extent[1] = extent[1].cwiseMax(p);
        const std::array<std::span<const Vec3>, kNames.size()> values{frame.points, frame.velocities, frame.normals,
                                                                      extent};
        for (std::size_t k = 0; k < values.size(); ++k) {
            if (values[k].empty() && k > 0) continue;
            TextWriter text{kDigits};
            text << "            " << number << ": ";
            addVectors(text, values[k]);
            text << ",\n";
            pieces[k].push_back(spool.add(text));
        }
    }
    void write(Stream& out, Spool& spool) const
    {
        for (std::size_t k = 0; k < pieces.size(); ++k) {
            if (pieces[k].empty()) continue;
            out.add(std::string("        ") + kNames[k] + ".timeSamples = {\n");
            for (const Spool::Piece& piece : pieces[k]) out.add(spool.read(piece));
            out.add("        }\n");
        }
    }
};

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
    writeAtomically(file, [&](const std::filesystem::path& temporary) {
        Spool spool(temporary.string() + ".samples");
        std::vector<Samples> samples(bodies.size());
        for (std::size_t f = 0; f < frames; ++f) {
            const std::vector<CacheFrame> frame = give(f);
            for (std::size_t b = 0; b < bodies.size(); ++b) samples[b].add(frame[b], scene.firstFrame + int(f), spool);
        }
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
            out.add(text);
            samples[b].write(out, spool);
            TextWriter end{kDigits};
            addSubsets(end, *bodies[b], materials);
            end << "    }\n";
            out.add(end);
        }
        TextWriter tail;
        tail << "}\n";
        out.add(tail);
        out.end();
    });
}

}  // namespace vdbfrac::tetmesh
