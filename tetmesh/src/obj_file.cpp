#include <vdbfrac/tetmesh/obj_file.h>

#include "text_reader.h"
#include "text_writer.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/tetmesh/mtl_file.h>

#include <algorithm>
#include <cassert>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

namespace vdbfrac::tetmesh {

namespace {

constexpr int kDigits = 9;  // of a coordinate: more than a float holds, which is what programs make of it
constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
constexpr std::string_view kObject = "fragment_", kTornGroup = "_inside";

std::string objectName(std::uint32_t fragment)
{
    const std::string digits = std::to_string(fragment);
    return std::string(kObject) + std::string(digits.size() < 4 ? 4 - digits.size() : 0, '0') + digits;
}

/// How many of each a file has so far.
struct Written {
    std::uint32_t points = 0, uvs = 0, normals = 0;
};

/// Writes one fragment after the other, with the numbers of the points that are already there.
class ObjWriter {
public:
    ObjWriter(const DrawnPart& body, TextWriter& text, Written& written)
        : drawn_(body.topology),
          points_(body.points),
          normals_(body.normals),
          number_(points_.size(), kUnused),
          uvNumber_(drawn_.mesh.uvs.size(), kUnused),
          normalNumber_(normals_.size(), kUnused),
          written_(written),
          text_(text)
    {
    }

    /// Points, texture coordinates and normals of faces, which come next.
    void addPoints(std::span<const std::uint32_t> faces)
    {
        addNumbered("v", points_, number_, written_.points, faces, &Corner::point);
        addNumbered("vt", drawn_.mesh.uvs, uvNumber_, written_.uvs, faces, &Corner::uv);
        addNumbered("vn", normals_, normalNumber_, written_.normals, faces, &Corner::normal);
    }
    /// Faces of one fragment.
    void addFaces(std::span<const std::uint32_t> faces)
    {
        const std::string name = objectName(drawn_.fragment[faces[0]]);
        addOutside(faces, name);
        addInside(faces, name);
    }

private:
    using Corner = RenderMesh::Corner;

    void addNumbered(std::string_view key, std::span<const Vec3> values, std::vector<std::uint32_t>& number,
                     std::uint32_t& written, std::span<const std::uint32_t> faces, std::uint32_t Corner::*member)
    {
        for (const std::uint32_t i : usedBy(drawn_.mesh, faces, member)) {
            number[i] = ++written;
            const Vec3& x = values[i];
            if (key == "vt" && x.z() == 0)
                text_.line(key, x.x(), x.y());
            else
                text_.line(key, x.x(), x.y(), x.z());
        }
    }
    void addOutside(std::span<const std::uint32_t> faces, const std::string& name)
    {
        const RenderMesh& mesh = drawn_.mesh;
        std::uint32_t group = kUnused - 1, material = kUnused - 1;  // of no face
        for (std::uint32_t f : faces) {
            if (drawn_.torn[f]) continue;
            if (mesh.group[f] != group) {
                group = mesh.group[f];
                text_ << "g " << (group == RenderMesh::kNone ? name + "_outside" : mesh.groups[group]) << "\n";
            }
            if (mesh.material[f] != material) {
                material = mesh.material[f];
                text_ << "usemtl " << materialOf(drawn_, f) << "\n";
            }
            addFace(f);
        }
    }
    void addInside(std::span<const std::uint32_t> faces, const std::string& name)
    {
        bool begun = false;
        for (std::uint32_t f : faces) {
            if (!drawn_.torn[f]) continue;
            if (!begun) text_ << "g " << name << kTornGroup << "\nusemtl " << materialOf(drawn_, f) << "\n";
            begun = true;
            addFace(f);
        }
    }
    void addFace(std::uint32_t f)
    {
        text_ << "f";
        for (const Corner& c : drawn_.mesh.face(f)) {
            text_ << " " << number_[c.point];
            if (c.uv == RenderMesh::kNone && c.normal == RenderMesh::kNone) continue;
            text_ << "/";
            if (c.uv != RenderMesh::kNone) text_ << uvNumber_[c.uv];
            if (c.normal != RenderMesh::kNone) text_ << "/" << normalNumber_[c.normal];
        }
        text_ << "\n";
    }

    const DrawnTopology& drawn_;
    std::span<const Vec3> points_, normals_;
    std::vector<std::uint32_t> number_, uvNumber_, normalNumber_;  // in the file, of the fragment being written
    Written& written_;
    TextWriter& text_;
};

std::uint32_t fragmentOf(const std::string& name, const std::string& file)
{
    if (name.starts_with(kObject))
        if (const auto id = TextReader::parse<std::uint32_t>(std::string_view(name).substr(kObject.size()))) return *id;
    throw InputError({file, "object '" + TextReader::shown(name) + "'", "fragment_ and a number", ""});
}

}  // namespace

std::vector<std::vector<std::uint32_t>> facesOfFragments(const DrawnTopology& drawn)
{
    assert(drawn.fragment.size() == drawn.mesh.faces() && drawn.torn.size() == drawn.mesh.faces());
    std::vector<std::uint32_t> order(drawn.mesh.faces());
    std::iota(order.begin(), order.end(), 0u);
    const auto fragment = [&](std::uint32_t f) { return drawn.fragment[f]; };
    std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return fragment(a) < fragment(b); });
    std::vector<std::vector<std::uint32_t>> all;
    for (std::uint32_t f : order) {
        if (all.empty() || fragment(all.back()[0]) != fragment(f)) all.emplace_back();
        all.back().push_back(f);
    }
    return all;
}

namespace {

/// Writes bodies one after the other: what add(writer, text, drawn) makes of each.
template <class Add>
void writeBodies(const std::filesystem::path& file, std::span<const DrawnPart> bodies, const std::string& mtlName,
                 const Add& add)
{
    TextWriter text{kDigits};
    if (!mtlName.empty()) text << "mtllib " << mtlName << "\n";
    Written written;
    for (const DrawnPart& body : bodies) {
        ObjWriter writer(body, text, written);
        add(writer, text, body.topology);
    }
    writeText(file, text.text());
}

}  // namespace

void writeObjFrame(const std::filesystem::path& file, std::span<const DrawnPart> bodies, const std::string& mtlName)
{
    writeBodies(file, bodies, mtlName, [](ObjWriter& writer, TextWriter& text, const DrawnTopology& drawn) {
        for (const auto& faces : facesOfFragments(drawn)) {
            text << "o " << objectName(drawn.fragment[faces[0]]) << "\n";
            writer.addPoints(faces);
            writer.addFaces(faces);
        }
    });
}

void writeObjWhole(const std::filesystem::path& file, std::span<const DrawnPart> bodies, const std::string& mtlName)
{
    writeBodies(file, bodies, mtlName, [](ObjWriter& writer, TextWriter&, const DrawnTopology& drawn) {
        std::vector<std::uint32_t> all(drawn.mesh.faces());
        std::iota(all.begin(), all.end(), 0u);
        writer.addPoints(all);
        for (const auto& faces : facesOfFragments(drawn)) writer.addFaces(faces);
    });
}

void writeObj(const std::filesystem::path& file, const Surface& surface, const std::string& mtlName)
{
    const DrawnTopology drawn = drawnTopology(surface);
    const DrawnPart body{drawn, surface.points, {}};
    writeObjFrame(file, {&body, 1}, mtlName);
}

namespace {

/// Is a face of a frame torn? By its group, that of its fragment; and by its material, as a surface that was itself a
/// frame may have groups of such names.
bool isTorn(const RenderMesh& frame, std::size_t face, const std::string& fragment)
{
    const std::uint32_t group = frame.group[face], material = frame.material[face];
    if (group == RenderMesh::kNone || material == RenderMesh::kNone) return false;
    const std::string& name = frame.groups[group];
    return name.size() == fragment.size() + kTornGroup.size() && name.starts_with(fragment) &&
           name.ends_with(kTornGroup) && isTornMaterial(frame.materials[material]);
}

}  // namespace

DrawnTopology readDrawnObj(const std::filesystem::path& file)
{
    ObjObjects all = readObjObjects(readText(file), file.string());
    std::vector<std::uint32_t> ids;
    for (const std::string& name : all.objects) ids.push_back(fragmentOf(name, file.string()));
    DrawnTopology drawn;
    drawn.mesh = std::move(all.mesh);
    for (std::size_t f = 0; f < drawn.mesh.faces(); ++f) {
        const std::uint32_t object = all.objectOfFace[f];
        drawn.fragment.push_back(object == RenderMesh::kNone ? 0 : ids[object]);
        drawn.torn.push_back(object != RenderMesh::kNone && isTorn(drawn.mesh, f, all.objects[object]));
    }
    return drawn;
}

Surface readObjFrame(const std::filesystem::path& file)
{
    const DrawnTopology drawn = readDrawnObj(file);
    return triangleSurface(drawn, drawn.mesh.points);
}

}  // namespace vdbfrac::tetmesh
