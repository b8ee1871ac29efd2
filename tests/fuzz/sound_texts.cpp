#include "sound_files.h"

#include <vdbfrac/lab/study/study_table.h>

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/scene/reader.h>

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace vdbfrac::fuzz {

namespace {

// A tetrahedron.
constexpr float kPoints[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
constexpr int kTriangles[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

template <class T>
void append(std::string& bytes, T value, bool bigEndian = false)
{
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    if (bigEndian) std::reverse(raw, raw + sizeof(T));
    bytes.append(raw, sizeof(T));
}

std::string pointLine(const float (&p)[3])
{
    return std::to_string(p[0]) + " " + std::to_string(p[1]) + " " + std::to_string(p[2]);
}

std::string textBody()
{
    std::string text;
    for (const auto& p : kPoints) text += pointLine(p) + "\n";
    for (const auto& t : kTriangles)
        text += "3 " + std::to_string(t[0]) + " " + std::to_string(t[1]) + " " + std::to_string(t[2]) + "\n";
    return text;
}

std::string binaryPly(bool big)
{
    std::string bytes =
        std::string("ply\nformat binary_") + (big ? "big" : "little") +
        "_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
        "element face 4\nproperty list uchar int vertex_indices\nend_header\n";
    for (const auto& p : kPoints) {
        for (float x : p) append(bytes, x, big);
        append(bytes, std::uint8_t{7});
    }
    for (const auto& t : kTriangles) {
        append(bytes, std::uint8_t{3});
        for (int corner : t) append(bytes, std::int32_t(corner), big);
    }
    return bytes;
}

using scene::Key, scene::Type;
const Key kKeys[] = {{"toughness", Type::number, "J/m^2", "A number.", "", 0, 1e300, true},
                     {"smooth", Type::boolean, "", "A truth.", "true"},
                     {"every", Type::integer, "", "A whole number.", "1", 1, 100},
                     {"steps", Type::autoInteger, "", "Or by itself.", "\"auto\"", 1, 100},
                     {"mode", Type::choice, "", "One of several.", "\"a\"", 0, 0, false, false, {"a", "b"}},
                     {"modes", Type::choices, "", "Some of several.", "[]", 0, 0, false, false, {"a", "b"}},
                     {"along", Type::direction, "", "A direction.", "\"y\""},
                     {"pull", Type::vector, "m/s^2", "A vector.", "[0, -9.81, 0]"},
                     {"between", Type::range, "", "A range.", "[1, 2]"},
                     {"called", Type::label, "", "A name.", "\"x\""},
                     {"keys", Type::curve, "", "A factor over time.", "", 0, 1e300, true}};
const scene::TableSpec kTable = {"fracture", "Like an effect.", kKeys};

/// A scene that ships, with its effects replaced.
std::string shipped(const char* name)
{
    const std::string text = readText(std::string(VDBFRAC_SOURCE "/data/scenes/") + name);
    return text.substr(0, std::min(text.find("[gravity]"), text.find("[damping]"))) +
           "[fracture]\ntoughness = 100\nalong = [1, 2, 2]\nmodes = [\"b\"]\npull = [0, 1, 0]\nbetween = [3, 4]\n"
           "keys = [{ time = 0, scale = 1 }, { time = 1, scale = 1e-6 }]\n";
}

}  // namespace

scene::Vocabulary vocabulary()
{
    scene::Vocabulary all = lab::study::vocabulary();
    all.tables = {kTable};
    return all;
}

std::vector<std::string> soundScenes()
{
    const std::string meshes =
        "version = 1\nname = \"m\"\n[grid]\nvoxel_size = 0.1\n[[body]]\nname = \"a\"\nshape = { mesh = \"x.obj\" }\n"
        "material = \"gel\"\nvelocity = [0, 1e-3, -0.5]\n[material]\ngel = { youngs_modulus = 1e5, poisson_ratio = "
        "0.3, density = 1000 }\n";
    const std::string study =
        "[study]\nrounds = 1\n[[study.series]]\nname = \"s\"\nset = [\"time.fps=2\"]\nkey = \"grid.coarsening\"\n"
        "values = [1, 2.5, \"x\", true]\ntied = [{ key = \"a\", values = [1, 2, 3, 4] }]\nrefines = \"up\"\n"
        "[[study.measure]]\nquantity = \"displacement\"\npoint = [0, 1, 0]\naxis = \"y\"\nexact = 1\n";
    return {scene::exampleText(), meshes, meshes + study, shipped("two_bodies.toml"), shipped("twist.toml")};
}

std::vector<std::string> soundObjs()
{
    std::string plain, relative = "mtllib x.mtl\r\no thing\r\n";
    for (const auto& p : kPoints) {
        plain += "v " + pointLine(p) + "\n";
        relative += "v " + pointLine(p) + " 1\r\n";
    }
    plain += "vn 0 0 1\nvt 0 0\nf 1 3 2\nf 1/1 2/1 4/1\nf 1/1/1 4/1/1 3/1/1\nf 2//1 3//1 \\\n4//1\n";
    relative += "g a b\r\nusemtl m\r\nf -4 -2 -3\r\nf -4 -3 -1\r\nf -4 -1 -2\r\nf -3 -2 -1";
    return {plain, relative};
}

std::vector<std::string> soundStls()
{
    std::string text = "solid tet\n", binary(80, ' ');
    append(binary, std::uint32_t{4});
    for (const auto& t : kTriangles) {
        text += "facet normal 0 0 0\nouter loop\n";
        for (int i = 0; i < 3; ++i) append(binary, 0.f);
        for (int corner : t) {
            text += "vertex " + pointLine(kPoints[corner]) + "\n";
            for (float x : kPoints[corner]) append(binary, x);
        }
        text += "endloop\nendfacet\n";
        append(binary, std::uint16_t{0});
    }
    return {text + "endsolid tet\n", binary};
}

std::vector<std::string> soundPlys()
{
    const std::string head =
        "ply\nformat ascii 1.0\ncomment c\nelement vertex 4\nproperty double x\nproperty float y\nproperty float z\n"
        "element face 4\nproperty list uchar uint vertex_index\nend_header\n";
    return {head + textBody(), binaryPly(false), binaryPly(true)};
}

std::vector<std::string> soundOffs() { return {"OFF\n# c\n4 4 6\n" + textBody(), "COFF 4 4 0\n" + textBody()}; }

}  // namespace vdbfrac::fuzz
