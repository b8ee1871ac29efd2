// Frames as binary .ply: what .obj has no place for.
#include <vdbfrac/tetmesh/cache_files.h>

#include "text_writer.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/tetmesh/obj_file.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <numeric>
#include <sstream>
#include <string_view>

namespace vdbfrac::tetmesh {

static_assert(std::endian::native == std::endian::little);

namespace {

constexpr auto kLittle = std::endian::little;
constexpr const char* kPlaces[] = {"x", "y", "z", "vx", "vy", "vz", "rest_x", "rest_y", "rest_z"};
constexpr const char* kFormat = "ply\nformat binary_little_endian 1.0\nelement vertex ";
constexpr std::string_view kEnd = "end_header\n", kProperty = "property float ";

/// Vertices and faces as they come; the header knows their numbers in the end.
class PlyWriter {
public:
    /// `longFaces`: some have more corners than a byte can count.
    explicit PlyWriter(bool longFaces) : longFaces_(longFaces) {}

    /// Writes faces, and before them the points that they use, rising.
    void add(const PlyBody& body, std::span<const std::uint32_t> faces)
    {
        const RenderMesh& mesh = body.topology.mesh;
        number_.resize(std::max(number_.size(), mesh.points.size()));
        for (const std::uint32_t p : usedBy(mesh, faces)) {
            number_[p] = points_++;
            for (const Vec3* v : {&body.points[p], &body.velocities[p], &mesh.points[p]})
                for (int k = 0; k < 3; ++k) vertices_.bytes<kLittle>(float((*v)[k]));
            for (const std::vector<float>& values : body.values) vertices_.bytes<kLittle>(values[p]);
        }
        for (const std::uint32_t f : faces) {
            ++count_;
            const std::size_t corners = mesh.face(f).size();
            if (longFaces_)
                faces_.bytes<kLittle>(std::uint32_t(corners));
            else
                faces_.bytes<kLittle>(std::uint8_t(corners));
            for (const RenderMesh::Corner& c : mesh.face(f)) faces_.bytes<kLittle>(number_[c.point]);
            faces_.bytes<kLittle>(std::int32_t(body.topology.fragment[f]));
            faces_.bytes<kLittle>(body.topology.torn[f]);
        }
    }

    std::string text(std::span<const std::string> names) const
    {
        TextWriter head;
        head << kFormat << points_ << "\n";
        for (const char* name : kPlaces) head << kProperty << name << "\n";
        for (const std::string& name : names) head << kProperty << name << "\n";
        head << "element face " << count_ << "\nproperty list " << (longFaces_ ? "uint" : "uchar")
             << " int vertex_indices\nproperty int fragment\nproperty uchar torn\n"
             << kEnd;
        return std::string(head.text()) + std::string(vertices_.text()) + std::string(faces_.text());
    }

private:
    bool longFaces_;
    TextWriter vertices_, faces_;
    std::vector<std::int32_t> number_;
    std::int32_t points_ = 0;
    std::size_t count_ = 0;
};

bool hasLongFaces(const PlyBody& body)
{
    const RenderMesh& mesh = body.topology.mesh;
    for (std::size_t f = 0; f < mesh.faces(); ++f)
        if (mesh.face(f).size() > std::numeric_limits<std::uint8_t>::max()) return true;
    return false;
}

}  // namespace

void writePlyFrame(const std::filesystem::path& file, std::span<const PlyBody> bodies, PlyOrder order,
                   std::span<const std::string> names)
{
    PlyWriter writer(std::any_of(bodies.begin(), bodies.end(), hasLongFaces));
    for (const PlyBody& body : bodies) {
        if (order == PlyOrder::byFragment) {
            for (const auto& faces : facesOfFragments(body.topology)) writer.add(body, faces);
            continue;
        }
        std::vector<std::uint32_t> all(body.topology.mesh.faces());
        std::iota(all.begin(), all.end(), 0u);
        writer.add(body, all);
    }
    writeText(file, writer.text(names));
}

std::map<std::string, std::vector<float>> readPlyValues(const std::filesystem::path& file)
{
    const std::string text = readText(file);
    const auto refuse = [&] {
        throw InputError({file.string(), "is not a .ply frame of a run", "what output.ply = true writes", ""});
    };
    const std::size_t end = text.find(kEnd);
    if (!text.starts_with(kFormat) || end == std::string::npos) refuse();
    std::istringstream head(text.substr(std::string_view(kFormat).size(), end - std::string_view(kFormat).size()));
    std::size_t count = 0;
    head >> count;
    std::vector<std::string> names;
    for (std::string line; std::getline(head, line);)
        if (line.starts_with(kProperty)) names.push_back(line.substr(kProperty.size()));
    const std::size_t first = end + kEnd.size();
    if (names.size() < std::size(kPlaces) || count > (text.size() - first) / (sizeof(float) * names.size())) refuse();
    std::map<std::string, std::vector<float>> values;
    for (std::size_t k = std::size(kPlaces); k < names.size(); ++k) {
        std::vector<float>& own = values[names[k]];
        own.resize(count);
        for (std::size_t i = 0; i < count; ++i)
            std::memcpy(&own[i], text.data() + first + sizeof(float) * (i * names.size() + k), sizeof(float));
    }
    return values;
}

float lowEndOf(std::span<const float> values)
{
    float low = std::numeric_limits<float>::infinity();
    for (const float v : values)
        if (v >= 0) low = std::min(low, v);
    return low;
}

float highEndOf(std::vector<float> values)
{
    constexpr std::size_t kOneIn = 200;
    if (values.empty()) return 0;
    const auto end = values.end() - std::ptrdiff_t(values.size() / kOneIn) - 1;
    std::nth_element(values.begin(), end, values.end());
    return *end;
}

}  // namespace vdbfrac::tetmesh
