// Our own readers instead of CGAL's polygon-soup ones, which a test compares them with: those accept an OBJ index 0,
// let a NaN corner of an STL fall onto another point, allocate what a PLY or OFF header or list count declares before
// looking at the file, and cannot say in which line something is wrong.
#include <vdbfrac/tetmesh/surface_input.h>

#include "text_reader.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/tetmesh/render_mesh.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>

namespace vdbfrac::tetmesh {

namespace {

constexpr std::size_t kStlHeader = 84;    // 80 bytes of anything, then the count
constexpr std::size_t kStlTriangle = 50;  // normal, three corners, two bytes of attributes

/// Joins corners with the same coordinates, as STL has no indices. Exact: a distance would need a unit.
class CornerJoiner {
public:
    explicit CornerJoiner(PolygonSoup& soup) : soup_(soup) {}

    std::size_t add(const Vec3& X)
    {
        const std::array<double, 3> key{X.x() + 0., X.y() + 0., X.z() + 0.};  // -0 becomes 0
        const auto [it, isNew] = indices_.emplace(key, soup_.points.size());
        if (isNew) soup_.points.push_back(X);
        return it->second;
    }

private:
    PolygonSoup& soup_;
    std::map<std::array<double, 3>, std::size_t> indices_;
};

std::uint32_t littleEndian32(const char* bytes)
{
    std::uint32_t value = 0;
    for (int i = 3; i >= 0; --i) value = value << 8 | static_cast<unsigned char>(bytes[i]);
    return value;
}

PolygonSoup readBinaryStl(std::string_view bytes, const std::string& file)
{
    PolygonSoup soup;
    CornerJoiner corners(soup);
    const std::size_t count = littleEndian32(bytes.data() + 80);
    soup.polygons.reserve(count);
    for (std::size_t t = 0; t < count; ++t) {
        const char* at = bytes.data() + kStlHeader + t * kStlTriangle + 3 * sizeof(float);
        std::vector<std::size_t>& polygon = soup.polygons.emplace_back(3);
        for (std::size_t& corner : polygon) {
            Vec3 X;
            for (int a = 0; a < 3; ++a, at += sizeof(float)) X[a] = std::bit_cast<float>(littleEndian32(at));
            if (!(X.cwiseAbs().maxCoeff() <= TextReader::kLargest))
                throw InputError({file,
                                  "triangle " + std::to_string(t) + " has a corner that is not finite or too large",
                                  "numbers from -1e30 to 1e30", ""});
            corner = corners.add(X);
        }
    }
    return soup;
}

PolygonSoup readTextStl(std::string_view text, const std::string& file)
{
    PolygonSoup soup;
    CornerJoiner corners(soup);
    std::vector<std::size_t> polygon;
    bool ended = false;
    for (TextReader in(text, file); in.nextDataLine();) {
        const std::string_view key = in.word();
        if (key == "vertex") {
            polygon.push_back(corners.add(in.point()));
        } else if (key == "endfacet") {
            if (polygon.size() != 3) in.fail("a facet with " + std::to_string(polygon.size()) + " vertices", "3");
            soup.polygons.push_back(std::move(polygon));
            polygon.clear();
        } else if (key != "facet" && key != "outer" && key != "endloop" && key != "solid" && key != "endsolid") {
            in.fail("'" + TextReader::shown(key) + "' is no part of a text STL",
                    "solid, facet, outer loop, vertex, endloop, endfacet, endsolid");
        }
        ended = key == "endsolid";
    }
    if (!ended) throw InputError({file, "ends before 'endsolid'", "a complete file", ""});
    return soup;
}

/// Peak bytes for each byte of a file: its text twice, then points and faces. Faces of few characters, "f 1 2 3", cost
/// most.
constexpr std::uint64_t kBytesPerFileByte = 20;

void requireMemory(const std::filesystem::path& file, std::uint64_t limit)
{
    std::error_code none;
    const std::uint64_t size = std::filesystem::file_size(file, none);
    if (!none && size > limit / kBytesPerFileByte)
        throw LimitError(file.string() + ": reading " + std::to_string(size) + " bytes may take " +
                         std::to_string(size * kBytesPerFileByte) + ", the memory limit is " + std::to_string(limit));
}

void requireKnown(const std::string& extension, const std::string& name)
{
    if (extension != ".obj" && extension != ".ply" && extension != ".stl" && extension != ".off")
        throw InputError({name, "'" + extension + "' is not a known surface format", ".obj, .ply, .stl, .off", ""});
}

}  // namespace

std::string extensionOf(const std::filesystem::path& file)
{
    std::string e = file.extension().string();
    for (char& c : e)
        if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
    return e;
}

PolygonSoup readObj(std::string_view text, const std::string& file) { return soupOf(readObjMesh(text, file)); }

PolygonSoup readStl(std::string_view bytes, const std::string& file)
{
    // Many binary files begin with "solid" too, so the size decides.
    const std::uint64_t expected =
        bytes.size() < kStlHeader ? 0 : kStlHeader + std::uint64_t(littleEndian32(bytes.data() + 80)) * kStlTriangle;
    if (expected > 0 && expected == bytes.size()) return readBinaryStl(bytes, file);
    const bool text = bytes.starts_with("solid") && bytes.find('\0') == std::string_view::npos;
    if (text) return readTextStl(bytes, file);
    if (expected > 0 && expected < bytes.size()) return readBinaryStl(bytes, file);  // some writers append to it
    throw InputError({file,
                      "a binary STL of " + std::to_string(bytes.size()) + " bytes whose triangle count asks for " +
                          std::to_string(expected),
                      "84 bytes and 50 for each triangle", "the file may be cut off"});
}

PolygonSoup readOff(std::string_view text, const std::string& file)
{
    TextReader in(text, file);
    if (!in.nextDataLine()) throw InputError({file, "is empty", "an OFF file", ""});
    const std::string_view kind = in.word();
    if (kind != "OFF" && kind != "COFF" && kind != "NOFF" && kind != "CNOFF")
        in.fail("'" + TextReader::shown(kind) + "' does not start a file of 3D points", "OFF, COFF, NOFF, CNOFF");
    if (in.restOfLine().find("BINARY") != std::string_view::npos) in.fail("binary OFF is not read", "text OFF");
    const std::string_view rest = in.restOfLine().substr(0, in.restOfLine().find('#'));
    if (rest.find_first_of("0123456789") == std::string_view::npos && !in.nextDataLine())
        in.fail("the counts are missing");
    // Every point and face has a line of two bytes or more.
    const std::size_t points = in.index(text.size(), "number of points");
    const std::size_t faces = in.index(text.size(), "number of faces");
    PolygonSoup soup;
    for (std::size_t i = 0; i < points; ++i) {
        if (!in.nextDataLine()) in.fail("ends after " + std::to_string(i) + " points of " + std::to_string(points));
        soup.points.push_back(in.point());
    }
    for (std::size_t i = 0; i < faces; ++i) {
        if (!in.nextDataLine()) in.fail("ends after " + std::to_string(i) + " of " + std::to_string(faces) + " faces");
        std::vector<std::size_t> polygon(in.index(text.size(), "number of corners"));
        for (std::size_t& corner : polygon) corner = in.index(points, "point index");
        addPolygon(soup, std::move(polygon));
    }
    return soup;
}

PolygonSoup readSurface(const std::filesystem::path& file, std::uint64_t memoryLimit)
{
    const std::string extension = extensionOf(file);
    std::error_code none;
    if (std::filesystem::status(file, none).type() == std::filesystem::file_type::not_found)
        throw FileError(file.string(), "No such file or directory");
    requireKnown(extension, file.string());
    requireMemory(file, memoryLimit);
    return parseSurface(readText(file), extension, file.string());
}

RenderMesh readRenderMesh(const std::filesystem::path& file, std::uint64_t memoryLimit)
{
    if (extensionOf(file) != ".obj") return renderMesh(readSurface(file, memoryLimit));
    requireMemory(file, memoryLimit);
    RenderMesh mesh = readObjMesh(readText(file), file.string());
    if (mesh.points.empty() || mesh.faces() == 0)
        throw InputError({file.string(), "holds no faces", "a surface of polygons", ""});
    return mesh;
}

PolygonSoup parseSurface(std::string_view bytes, const std::string& extension, const std::string& name)
{
    requireKnown(extension, name);
    PolygonSoup soup = extension == ".obj"   ? readObj(bytes, name)
                       : extension == ".ply" ? readPly(bytes, name)
                       : extension == ".stl" ? readStl(bytes, name)
                                             : readOff(bytes, name);
    for (const std::vector<std::size_t>& polygon : soup.polygons)
        for (std::size_t corner : polygon)
            if (corner >= soup.points.size())
                throw InputError(
                    {name, "a face uses point " + std::to_string(corner) + " of " + std::to_string(soup.points.size()),
                     "", ""});
    if (soup.points.empty() || soup.polygons.empty())
        throw InputError({name, "holds no faces", "a surface of polygons", ""});
    return soup;
}

}  // namespace vdbfrac::tetmesh
