#include <vdbfrac/tetmesh/tet_mesh.h>

#include <vdbfrac/base/parallel.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <utility>

namespace vdbfrac::tetmesh {

namespace {

/// A face of a tet, found again by its sorted corners.
struct Face {
    std::array<std::uint32_t, 3> key;
    std::uint32_t tet;
    std::uint8_t opposite;  // corner of the tet
};

// Corners of the face opposite each corner, outward where the tet has positive volume.
constexpr std::size_t kFace[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

}  // namespace

std::array<std::uint32_t, 4> lowestFirst(std::array<std::uint32_t, 4> tet)
{
    const std::size_t k = std::size_t(std::min_element(tet.begin(), tet.end()) - tet.begin());
    if (k == 0) return tet;
    std::swap(tet[0], tet[k]);
    std::swap(tet[k], tet[k % 3 + 1]);  // a second exchange keeps the orientation
    return tet;
}

std::vector<std::array<std::uint32_t, 3>> boundaryOf(std::span<const std::array<std::uint32_t, 4>> tets)
{
    std::vector<Face> faces;
    faces.reserve(4 * tets.size());
    for (std::size_t t = 0; t < tets.size(); ++t)
        for (std::size_t f = 0; f < 4; ++f) {
            std::array<std::uint32_t, 3> key{tets[t][kFace[f][0]], tets[t][kFace[f][1]], tets[t][kFace[f][2]]};
            std::sort(key.begin(), key.end());
            faces.push_back({key, std::uint32_t(t), std::uint8_t(f)});
        }
    std::sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) { return a.key < b.key; });
    std::vector<std::pair<std::uint32_t, std::uint8_t>> single;
    for (std::size_t i = 0, end; i < faces.size(); i = end) {
        for (end = i + 1; end < faces.size() && faces[end].key == faces[i].key; ++end) {}
        if (end == i + 1) single.emplace_back(faces[i].tet, faces[i].opposite);
    }
    std::sort(single.begin(), single.end());
    std::vector<std::array<std::uint32_t, 3>> boundary;
    for (auto [t, f] : single) boundary.push_back({tets[t][kFace[f][0]], tets[t][kFace[f][1]], tets[t][kFace[f][2]]});
    return boundary;
}

double tetVolume(const TetMesh& mesh, std::size_t t)
{
    const auto& tet = mesh.tets[t];
    const Vec3& p = mesh.points[tet[0]];
    return (mesh.points[tet[1]] - p).cross(mesh.points[tet[2]] - p).dot(mesh.points[tet[3]] - p) / 6;
}

double volumeOf(const TetMesh& mesh)
{
    return orderedSum(mesh.tets.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t t = begin; t < end; ++t) sum += tetVolume(mesh, t);
        return sum;
    });
}

}  // namespace vdbfrac::tetmesh
