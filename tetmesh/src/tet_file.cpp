#include <vdbfrac/tetmesh/tet_file.h>

#include "tet_text.h"
#include "text_reader.h"
#include "text_writer.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>

#include <algorithm>

namespace vdbfrac::tetmesh {

namespace fs = std::filesystem;

namespace {

/// https://www.ljll.fr/frey/publications/RT-0253.pdf; numbers count from 1, the last of a line is a region.
std::string meditText(const TetMesh& mesh)
{
    TextWriter out;
    out << "MeshVersionFormatted 2\nDimension 3\nVertices\n" << mesh.points.size() << "\n";
    for (const Vec3& p : mesh.points) out.line(p.x(), p.y(), p.z(), 0);
    out << "Triangles\n" << mesh.boundary.size() << "\n";
    for (const auto& f : mesh.boundary) out.line(f[0] + 1, f[1] + 1, f[2] + 1, 1);
    out << "Tetrahedra\n" << mesh.tets.size() << "\n";
    for (const auto& t : mesh.tets) out.line(t[0] + 1, t[1] + 1, t[2] + 1, t[3] + 1, 1);
    out << "End\n";
    return out.text();
}

/// https://wias-berlin.de/software/tetgen/fformats.html; all numbers count from 0.
std::string nodeText(const TetMesh& mesh)
{
    TextWriter out;
    out.line(mesh.points.size(), 3, 0, 0);
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
        out.line(i, mesh.points[i].x(), mesh.points[i].y(), mesh.points[i].z());
    return out.text();
}
std::string eleText(const TetMesh& mesh)
{
    TextWriter out;
    out.line(mesh.tets.size(), 4, 0);
    for (std::size_t t = 0; t < mesh.tets.size(); ++t)
        out.line(t, mesh.tets[t][0], mesh.tets[t][1], mesh.tets[t][2], mesh.tets[t][3]);
    return out.text();
}

void requireSane(const FileField& field, std::size_t count)
{
    const bool named = !field.name.empty() && std::all_of(field.name.begin(), field.name.end(), [](char c) {
        return c == '_' || (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    });
    if (!named)
        throw InputError(
            {"field '" + field.name + "'", "has no name that every format takes", "letters, digits and _", ""});
    if (field.values.size() != count)
        throw InputError({"field '" + field.name + "'", "has " + std::to_string(field.values.size()) + " values",
                          std::to_string(count), ""});
}

}  // namespace

TetFormat tetFormatOf(const fs::path& file)
{
    const std::string e = extensionOf(file);
    if (e == ".vtu") return TetFormat::vtu;
    if (e == ".vtk") return TetFormat::vtk;
    if (e == ".msh") return TetFormat::gmsh41;
    if (e == ".mesh") return TetFormat::medit;
    if (e == ".node" || e == ".ele") return TetFormat::tetgen;
    throw InputError(
        {file.string(), "'" + e + "' is not a known tet format", ".vtu, .vtk, .msh, .mesh, .node, .ele", ""});
}

std::vector<fs::path> writeTets(const fs::path& file, TetFormat format, const TetMesh& mesh, const TetFields& fields)
{
    for (const FileField& f : fields.onPoints) requireSane(f, mesh.points.size());
    for (const FileField& f : fields.onTets) requireSane(f, mesh.tets.size());
    for (std::size_t t = 0; t < mesh.tets.size(); ++t)
        if (std::ranges::max(mesh.tets[t]) >= mesh.points.size())
            throw InputError({"tet " + std::to_string(t),
                              "has a corner " + std::to_string(std::ranges::max(mesh.tets[t])),
                              "below " + std::to_string(mesh.points.size()) + ", as there are points", ""});
    if (format == TetFormat::tetgen) {
        const fs::path node = fs::path(file).replace_extension(".node"), ele = fs::path(file).replace_extension(".ele");
        writeText(node, nodeText(mesh));
        writeText(ele, eleText(mesh));
        return {node, ele};
    }
    writeText(file, format == TetFormat::vtu      ? vtuText(mesh, fields)
                    : format == TetFormat::vtk    ? vtkText(mesh, fields)
                    : format == TetFormat::gmsh41 ? gmsh41Text(mesh, fields)
                    : format == TetFormat::gmsh22 ? gmsh22Text(mesh, fields)
                                                  : meditText(mesh));
    return {file};
}

}  // namespace vdbfrac::tetmesh
