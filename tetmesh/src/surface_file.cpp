#include <vdbfrac/tetmesh/surface_file.h>

#include "text_reader.h"
#include "text_writer.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/tetmesh/obj_file.h>

#include <Eigen/Geometry>

#include <algorithm>

namespace vdbfrac::tetmesh {

namespace {

constexpr auto kLittle = std::endian::little;

std::string plyText(const Surface& surface)
{
    TextWriter out;
    out << "ply\nformat binary_little_endian 1.0\nelement vertex " << surface.points.size()
        << "\nproperty double x\nproperty double y\nproperty double z\nelement face " << surface.triangles.size()
        << "\nproperty list uchar int vertex_indices\nproperty int fragment\nproperty uchar torn\nend_header\n";
    for (const Vec3& p : surface.points)
        for (int a = 0; a < 3; ++a) out.bytes<kLittle>(p[a]);
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
        out.bytes<kLittle>(std::uint8_t(3));
        for (std::uint32_t v : surface.triangles[t]) out.bytes<kLittle>(std::int32_t(v));
        out.bytes<kLittle>(std::int32_t(surface.fragment[t]));
        out.bytes<kLittle>(std::uint8_t(surface.torn[t] != 0));
    }
    return out.text();
}

std::string stlText(const Surface& surface)
{
    TextWriter out;
    std::string head = "binary, from vdbfrac";  // must not begin with "solid": that is how text files begin
    head.resize(80, ' ');
    out << head;
    out.bytes<kLittle>(std::uint32_t(surface.triangles.size()));
    for (const auto& t : surface.triangles) {
        const Vec3 &a = surface.points[t[0]], &b = surface.points[t[1]], &c = surface.points[t[2]];
        const Vec3 normal = (b - a).cross(c - a).stableNormalized();
        for (const Vec3& v : {normal, a, b, c})
            for (int k = 0; k < 3; ++k) out.bytes<kLittle>(float(v[k]));
        out.bytes<kLittle>(std::uint16_t(0));
    }
    return out.text();
}

/// Throws InputError.
void requireSound(const std::filesystem::path& file, const Surface& surface)
{
    const auto refuse = [&](const std::string& what, const std::string& allowed) {
        throw InputError({file.string(), "the surface to be written has " + what, allowed, ""});
    };
    const std::size_t count = surface.triangles.size();
    if (surface.fragment.size() != count || surface.torn.size() != count)
        refuse("no fragment, or no torn, of some triangles", "one of each for each triangle");
    for (const auto& t : surface.triangles)
        if (const std::uint32_t last = std::max({t[0], t[1], t[2]}); last >= surface.points.size())
            refuse("a triangle with point " + std::to_string(last), "below " + std::to_string(surface.points.size()));
}

}  // namespace

bool isSurfaceFile(const std::filesystem::path& file)
{
    const std::string e = extensionOf(file);
    return e == ".obj" || e == ".ply" || e == ".stl";
}

void writeSurface(const std::filesystem::path& file, const Surface& surface)
{
    requireSound(file, surface);
    const std::string e = extensionOf(file);
    if (e == ".obj") return writeObj(file, surface, "");
    if (e == ".ply") return writeText(file, plyText(surface));
    if (e == ".stl") return writeText(file, stlText(surface));
    throw InputError({file.string(), "'" + e + "' is not a known surface format", ".obj, .ply, .stl", ""});
}

}  // namespace vdbfrac::tetmesh
