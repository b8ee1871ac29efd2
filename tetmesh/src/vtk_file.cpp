// VTK's formats: https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html
#include "tet_text.h"
#include "text_writer.h"

#include <bit>
#include <cstdint>

namespace vdbfrac::tetmesh {

namespace {

constexpr std::uint8_t kVtkTetra = 10;

/// Arrays of a .vtu: what the XML says of them, and their bytes behind it, each after its length.
class AppendedArrays {
public:
    template <class T>
    std::string add(const std::string& attributes, std::size_t count, const auto& fill)
    {
        std::string element = "<DataArray " + attributes + " format=\"appended\" offset=\"" +
                              std::to_string(data_.text().size()) + "\"/>\n";
        data_.bytes<std::endian::little>(std::uint64_t(count * sizeof(T)));
        fill([&](T value) { data_.bytes<std::endian::little>(value); });
        return element;
    }
    std::string add(const FileField& field)
    {
        return add<double>("type=\"Float64\" Name=\"" + field.name + "\"", field.values.size(), [&](auto put) {
            for (double v : field.values) put(v);
        });
    }
    void reserve(std::size_t bytes) { data_.reserve(bytes); }
    const std::string& bytes() const { return data_.text(); }

private:
    TextWriter data_;
};

std::string fieldElements(AppendedArrays& arrays, const std::vector<FileField>& fields, const std::string& element)
{
    if (fields.empty()) return "";
    std::string text = "<" + element + ">\n";
    for (const FileField& f : fields) text += arrays.add(f);
    return text + "</" + element + ">\n";
}

std::string cellElements(AppendedArrays& arrays, const TetMesh& mesh)
{
    const std::size_t tets = mesh.tets.size();
    return "<Cells>\n" + arrays.add<std::int64_t>("type=\"Int64\" Name=\"connectivity\"", 4 * tets, [&](auto put) {
        for (const auto& t : mesh.tets)
            for (std::uint32_t v : t) put(v);
    }) + arrays.add<std::int64_t>("type=\"Int64\" Name=\"offsets\"", tets, [&](auto put) {
        for (std::size_t t = 1; t <= tets; ++t) put(std::int64_t(4 * t));
    }) + arrays.add<std::uint8_t>("type=\"UInt8\" Name=\"types\"", tets, [&](auto put) {
        for (std::size_t t = 0; t < tets; ++t) put(kVtkTetra);
    }) + "</Cells>\n";
}

void addFields(TextWriter& out, const std::vector<FileField>& fields, const std::string& where, std::size_t count)
{
    if (fields.empty()) return;
    out << where << " " << count << "\nFIELD FieldData " << fields.size() << "\n";
    for (const FileField& f : fields) {
        out << f.name << " 1 " << count << " double\n";
        for (double v : f.values) out.bytes<std::endian::big>(v);
        out << "\n";
    }
}

}  // namespace

std::string vtuText(const TetMesh& mesh, const TetFields& fields)
{
    AppendedArrays arrays;
    arrays.reserve(24 * mesh.points.size() + 41 * mesh.tets.size());
    const std::string points =
        "<Points>\n" +
        arrays.add<double>("type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\"", 3 * mesh.points.size(),
                           [&](auto put) {
                               for (const Vec3& p : mesh.points)
                                   for (int a = 0; a < 3; ++a) put(p[a]);
                           }) +
        "</Points>\n";
    const std::string body = points + cellElements(arrays, mesh) + fieldElements(arrays, fields.onPoints, "PointData") +
                             fieldElements(arrays, fields.onTets, "CellData");
    return "<?xml version=\"1.0\"?>\n"
           "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
           "<UnstructuredGrid>\n<Piece NumberOfPoints=\"" +
           std::to_string(mesh.points.size()) + "\" NumberOfCells=\"" + std::to_string(mesh.tets.size()) + "\">\n" +
           body + "</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_" + arrays.bytes() +
           "\n</AppendedData>\n</VTKFile>\n";
}

std::string vtkText(const TetMesh& mesh, const TetFields& fields)
{
    TextWriter out;
    out << "# vtk DataFile Version 3.0\ntets\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS " << mesh.points.size()
        << " double\n";
    for (const Vec3& p : mesh.points)
        for (int a = 0; a < 3; ++a) out.bytes<std::endian::big>(p[a]);
    out << "\nCELLS " << mesh.tets.size() << " " << 5 * mesh.tets.size() << "\n";
    for (const auto& t : mesh.tets) {
        out.bytes<std::endian::big>(std::int32_t(4));
        for (std::uint32_t v : t) out.bytes<std::endian::big>(std::int32_t(v));
    }
    out << "\nCELL_TYPES " << mesh.tets.size() << "\n";
    for (std::size_t t = 0; t < mesh.tets.size(); ++t) out.bytes<std::endian::big>(std::int32_t(kVtkTetra));
    out << "\n";
    addFields(out, fields.onPoints, "POINT_DATA", mesh.points.size());
    addFields(out, fields.onTets, "CELL_DATA", mesh.tets.size());
    return out.text();
}

}  // namespace vdbfrac::tetmesh
