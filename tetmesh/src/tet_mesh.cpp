#include <vdbfrac/tetmesh/tet_mesh.h>

#include <vdbfrac/base/parallel.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <numeric>
#include <utility>

namespace vdbfrac::tetmesh {

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
    const auto key = [&](std::size_t face) {
        auto k = corners(face);
        std::sort(k.begin(), k.end());
        return k;
    };
    // Faces sorted by their lowest point: equal ones are then a few neighbours.
    std::vector<std::size_t> first;
    for (std::size_t face = 0; face < 4 * tets.size(); ++face) {
        const std::size_t lowest = key(face)[0];
        if (first.size() < lowest + 2) first.resize(lowest + 2);
        ++first[lowest + 1];
    }
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<std::size_t> faces(4 * tets.size()), next = first;
    for (std::size_t face = 0; face < faces.size(); ++face) faces[next[key(face)[0]]++] = face;

    std::vector<std::uint8_t> single(faces.size());
    parallelChunks(first.empty() ? 0 : first.size() - 1, kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p) {
            const std::span<const std::size_t> around = std::span(faces).subspan(first[p], first[p + 1] - first[p]);
            for (std::size_t a : around)
                single[a] = std::count_if(around.begin(), around.end(), [&](std::size_t b) { return key(a) == key(b); }) == 1;
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
