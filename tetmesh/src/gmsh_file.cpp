// Gmsh's formats: https://gmsh.info/doc/texinfo/gmsh.html#Gmsh-file-formats
#include "tet_text.h"
#include "text_writer.h"

#include <span>

namespace vdbfrac::tetmesh {

namespace {

constexpr int kTriangle = 2, kTetra = 4;  // element types
constexpr int kSurface = 1, kVolume = 1;  // tags of the two entities, and of the physical groups they are in

constexpr const char* kGroups = "$PhysicalNames\n2\n2 1 \"surface\"\n3 1 \"material\"\n$EndPhysicalNames\n";

/// A value for each node, or for each element: triangles come first and have none.
void addData(TextWriter& out, const std::vector<FileField>& fields, const std::string& section, std::size_t triangles)
{
    for (const FileField& f : fields) {
        out << "$" << section << "\n1\n\"" << f.name << "\"\n1\n0\n3\n0\n1\n" << triangles + f.values.size() << "\n";
        for (std::size_t i = 1; i <= triangles; ++i) out.line(i, 0);
        for (std::size_t i = 0; i < f.values.size(); ++i) out.line(triangles + i + 1, f.values[i]);
        out << "$End" << section << "\n";
    }
}

void addAllData(TextWriter& out, std::size_t triangles, const TetFields& fields)
{
    addData(out, fields.onPoints, "NodeData", 0);
    addData(out, fields.onTets, "ElementData", triangles);
}

}  // namespace

std::string gmsh22Text(const TetMesh& mesh, const TetFields& fields)
{
    TextWriter out;
    out << "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" << kGroups << "$Nodes\n" << mesh.points.size() << "\n";
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
        out.line(i + 1, mesh.points[i].x(), mesh.points[i].y(), mesh.points[i].z());
    // meshio stops at a 2.2 file that has both fields of elements and elements of two types.
    const std::size_t triangles = fields.onTets.empty() ? mesh.boundary.size() : 0;
    out << "$EndNodes\n$Elements\n" << triangles + mesh.tets.size() << "\n";
    std::size_t tag = 0;
    for (const auto& f : std::span(mesh.boundary).first(triangles))
        out.line(++tag, kTriangle, 2, kSurface, kSurface, f[0] + 1, f[1] + 1, f[2] + 1);
    for (const auto& t : mesh.tets)
        out.line(++tag, kTetra, 2, kVolume, kVolume, t[0] + 1, t[1] + 1, t[2] + 1, t[3] + 1);
    out << "$EndElements\n";
    addAllData(out, triangles, fields);
    return out.text();
}

std::string gmsh41Text(const TetMesh& mesh, const TetFields& fields)
{
    Vec3 lower = mesh.points.empty() ? Vec3::Zero().eval() : mesh.points[0], upper = lower;
    for (const Vec3& p : mesh.points) lower = lower.cwiseMin(p), upper = upper.cwiseMax(p);
    const std::size_t points = mesh.points.size(), triangles = mesh.boundary.size(), tets = mesh.tets.size();
    TextWriter out;
    out << "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n" << kGroups << "$Entities\n0 0 1 1\n";
    for (int bounding : {0, 1}) {  // the surface, and the volume that it bounds
        out << "1 " << lower.x() << " " << lower.y() << " " << lower.z() << " " << upper.x() << " " << upper.y() << " "
            << upper.z() << " 1 1 ";
        out << (bounding ? "1 1\n" : "0\n");
    }
    out << "$EndEntities\n$Nodes\n";
    out.line(1, points, 1, points);
    out.line(3, kVolume, 0, points);
    for (std::size_t i = 1; i <= points; ++i) out.line(i);
    for (const Vec3& p : mesh.points) out.line(p.x(), p.y(), p.z());
    out << "$EndNodes\n$Elements\n";
    out.line(2, triangles + tets, 1, triangles + tets);
    std::size_t tag = 0;
    out.line(2, kSurface, kTriangle, triangles);
    for (const auto& f : mesh.boundary) out.line(++tag, f[0] + 1, f[1] + 1, f[2] + 1);
    out.line(3, kVolume, kTetra, tets);
    for (const auto& t : mesh.tets) out.line(++tag, t[0] + 1, t[1] + 1, t[2] + 1, t[3] + 1);
    out << "$EndElements\n";
    addAllData(out, triangles, fields);
    return out.text();
}

}  // namespace vdbfrac::tetmesh
