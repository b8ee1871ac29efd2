#include <vdbfrac/tetmesh/winding.h>

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/polygon.h>
#include <vdbfrac/tetmesh/surface_input.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <utility>
#include <vector>

namespace vdbfrac::tetmesh {

namespace {

constexpr std::uint32_t kNone = RenderMesh::kNone;

/// The edges of faces, one behind each corner, and what they have in common.
class FaceEdges {
public:
    explicit FaceEdges(const RenderMesh& mesh) : mesh_(mesh)
    {
        const std::vector<std::size_t> place = equalPoints(mesh.points);
        for (std::uint32_t f = 0; f < mesh.faces(); ++f) {
            const auto face = mesh.face(f);
            for (std::size_t k = 0; k < face.size(); ++k) {
                from_.push_back(std::uint32_t(place[face[k].point]));
                to_.push_back(std::uint32_t(place[face[(k + 1) % face.size()].point]));
                faceOf_.push_back(f);
            }
        }
        findTwins();
    }

    std::uint32_t begin(std::uint32_t face) const { return face == 0 ? 0 : mesh_.faceEnd[face - 1]; }
    std::uint32_t end(std::uint32_t face) const { return mesh_.faceEnd[face]; }
    std::uint32_t faceOf(std::uint32_t edge) const { return faceOf_[edge]; }
    /// The same edge of the face beside it; none where there is no such face, or several.
    std::uint32_t twin(std::uint32_t edge) const { return twin_[edge]; }
    /// Where a face has one point twice in a row.
    bool isPoint(std::uint32_t edge) const { return from_[edge] == to_[edge]; }
    /// Do a face and that beside it run along their edge in one direction, so that they look opposite ways?
    bool disagrees(std::uint32_t edge) const { return from_[edge] == from_[twin_[edge]]; }

private:
    void findTwins()
    {
        twin_.assign(from_.size(), kNone);
        const Groups ofLesser = groupItems(mesh_.points.size(), [&](const auto& add) {
            for (std::uint32_t e = 0; e < from_.size(); ++e)
                if (from_[e] != to_[e]) add(std::min(from_[e], to_[e]), e);
        });
        const auto greater = [&](std::uint32_t e) { return std::max(from_[e], to_[e]); };
        std::vector<std::uint32_t> edges;
        for (std::size_t p = 0; p < mesh_.points.size(); ++p) {
            edges.assign(ofLesser[p].begin(), ofLesser[p].end());
            std::ranges::sort(edges, {}, greater);
            for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
                while (end < edges.size() && greater(edges[end]) == greater(edges[begin])) ++end;
                if (end - begin != 2) continue;
                twin_[edges[begin]] = edges[begin + 1], twin_[edges[begin + 1]] = edges[begin];
            }
        }
    }

    const RenderMesh& mesh_;
    std::vector<std::uint32_t> from_, to_, faceOf_, twin_;
};

/// One shell: its faces, and which of them run against the first.
struct Shell {
    std::vector<std::uint32_t> faces;
    bool isClosed = true, hasSides = true;
};

/// Goes from a face to those beside it; writes into `runs` whether they run against it: 0 or 1, 2 where not yet known.
Shell shellFrom(std::uint32_t first, const FaceEdges& edges, std::vector<std::uint8_t>& runs)
{
    Shell shell{{first}};
    runs[first] = 0;
    for (std::size_t i = 0; i < shell.faces.size(); ++i) {
        const std::uint32_t f = shell.faces[i];
        for (std::uint32_t e = edges.begin(f); e < edges.end(f); ++e) {
            if (edges.isPoint(e)) continue;
            if (edges.twin(e) == kNone) {
                shell.isClosed = false;
                continue;
            }
            const std::uint32_t other = edges.faceOf(edges.twin(e));
            const std::uint8_t expected = runs[f] ^ std::uint8_t(edges.disagrees(e));
            if (runs[other] > 1)
                runs[other] = expected, shell.faces.push_back(other);
            else
                shell.hasSides = shell.hasSides && runs[other] == expected;
        }
    }
    return shell;
}

}  // namespace

void turnFaces(RenderMesh& mesh, std::span<const std::uint8_t> isTurned)
{
    for (std::size_t f = 0, begin = 0; f < mesh.faces(); begin = mesh.faceEnd[f++])
        if (isTurned[f])
            std::reverse(mesh.corners.begin() + std::ptrdiff_t(begin), mesh.corners.begin() + mesh.faceEnd[f]);
    const Fans fans = fansOf(mesh);
    const std::size_t given = mesh.normals.size();
    std::vector<double> along(given, 0);
    for (std::size_t t = 0; t < fans.corners.size(); ++t) {
        if (!isTurned[fans.face[t]]) continue;
        const auto at = [&](std::size_t k) { return mesh.points[mesh.corners[fans.corners[t][k]].point]; };
        const Vec3 area = (at(1) - at(0)).cross(at(2) - at(0));
        for (const std::uint32_t c : fans.corners[t])
            if (const std::uint32_t n = mesh.corners[c].normal; n != kNone) along[n] += area.dot(mesh.normals[n]);
    }
    std::vector<std::uint32_t> turned(given, kNone);
    for (std::size_t n = 0; n < given; ++n)
        if (along[n] < 0) turned[n] = std::uint32_t(mesh.normals.size()), mesh.normals.push_back(-mesh.normals[n]);
    for (std::size_t f = 0, begin = 0; f < mesh.faces(); begin = mesh.faceEnd[f++])
        for (std::size_t c = begin; isTurned[f] && c < mesh.faceEnd[f]; ++c)
            if (std::uint32_t& n = mesh.corners[c].normal; n != kNone && along[n] < 0) n = turned[n];
}

std::size_t windShells(RenderMesh& mesh)
{
    const FaceEdges edges(mesh);
    std::vector<std::uint8_t> runs(mesh.faces(), 2), isTurned(mesh.faces(), 0);
    for (std::uint32_t first = 0; first < mesh.faces(); ++first) {
        if (runs[first] <= 1) continue;
        const Shell shell = shellFrom(first, edges, runs);
        if (!shell.hasSides) continue;
        double volume = 0;
        std::size_t against = 0;
        for (const std::uint32_t f : shell.faces) {
            const auto face = mesh.face(f);
            const auto at = [&](std::size_t k) -> const Vec3& { return mesh.points[face[k].point]; };
            volume += (runs[f] ? -1 : 1) * volumeBelow(face.size(), at);
            against += runs[f];
        }
        const bool turnsFirst = shell.isClosed ? volume < 0 : 2 * against > shell.faces.size();
        for (const std::uint32_t f : shell.faces) isTurned[f] = runs[f] ^ std::uint8_t(turnsFirst);
    }
    const auto turned = std::size_t(std::ranges::count(isTurned, 1));
    if (turned > 0) turnFaces(mesh, isTurned);
    return turned;
}

}  // namespace vdbfrac::tetmesh
