#include <vdbfrac/tetmesh/tet_mesh.h>

#include <vdbfrac/base/parallel.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <numeric>
#include <utility>

namespace vdbfrac::tetmesh {

namespace {

/// A face of a tet in the list of its lowest point: its two other points in order, and 4 x tet + its opposite corner.
struct Face {
    std::uint64_t others;
    std::size_t number;
};

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
    const auto corners = [&](std::size_t face) {
        const auto& tet = tets[face / 4];
        const auto& f = kTetFaces[face % 4];
        return std::array<std::uint32_t, 3>{tet[f[0]], tet[f[1]], tet[f[2]]};
    };
    // Faces by their lowest point: equal ones are then a few neighbours.
    std::vector<std::size_t> end;
    for (std::size_t face = 0; face < 4 * tets.size(); ++face) {
        const auto c = corners(face);
        const std::size_t lowest = std::min({c[0], c[1], c[2]});
        if (end.size() <= lowest) end.resize(lowest + 1);
        ++end[lowest];
    }
    std::exclusive_scan(end.begin(), end.end(), end.begin(), std::size_t(0));
    std::vector<Face> faces(4 * tets.size());
    for (std::size_t face = 0; face < faces.size(); ++face) {
        auto c = corners(face);
        std::sort(c.begin(), c.end());
        faces[end[c[0]]++] = {std::uint64_t(c[1]) << 32 | c[2], face};
    }
    std::vector<std::uint8_t> single(faces.size());
    parallelChunks(end.size(), kChunk, [&](std::size_t first, std::size_t last) {
        for (std::size_t p = first; p < last; ++p) {
            const std::size_t begin = p > 0 ? end[p - 1] : 0;
            const std::span<const Face> around = std::span(faces).subspan(begin, end[p] - begin);
            for (const Face& a : around)
                single[a.number] = std::count_if(around.begin(), around.end(),
                                                 [&](const Face& b) { return b.others == a.others; }) == 1;
        }
    });
    std::vector<std::array<std::uint32_t, 3>> boundary;
    for (std::size_t face = 0; face < single.size(); ++face)
        if (single[face]) boundary.push_back(corners(face));
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
