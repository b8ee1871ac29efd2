#include "body_volume.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/body_mesh.h>

#include <Eigen/Dense>

#include <algorithm>

namespace vdbfrac::tetmesh {

double BodyMesh::volume(const CellElement& element) const
{
    const CellTets& tets = cellTets(element.shape);
    double sum = 0;
    for (int t = 0; t < tets.count; ++t) sum += tets.volume[std::size_t(t)] * element.fraction[std::size_t(t)];
    const double h = spacing();
    return h * h * h * sum;
}

std::array<std::uint32_t, 4> tetNodes(const CellElement& element, std::uint32_t t)
{
    std::array<std::uint32_t, 4> node{};
    for (std::size_t a = 0; a < 4; ++a) node[a] = element.node[std::size_t(cellTets(element.shape).corner[t][a])];
    return node;
}

NodalShare BodyMesh::nodalShare(Coord voxel, const TetEnergy& energy) const
{
    NodalShare share;
    visitTets(voxel, [&](std::uint32_t element, int tet, double volume) {
        share.volume += volume;
        share.energy += volume * energy(element, tet);
    });
    return share;
}

RestTet restTet(const std::array<std::uint32_t, 4>& node, const std::array<Vec3, 4>& X)
{
    Mat3 edges;
    for (int a = 0; a < 3; ++a) edges.col(a) = X[std::size_t(a + 1)] - X[0];
    return {node, X[0], edges.inverse()};
}

RestTet BodyMesh::restTet(std::uint32_t e, std::uint32_t t) const
{
    const std::array<std::uint32_t, 4> node = tetNodes(elements()[e], t);
    std::array<Vec3, 4> X;
    for (std::size_t a = 0; a < 4; ++a) X[a] = restPosition(node[a]);
    return tetmesh::restTet(node, X);
}

std::optional<MaterialPoint> BodyMesh::locate(const Vec3& X, std::span<const std::uint32_t> near) const
{
    std::optional<MaterialPoint> best;
    double most = 0;
    for (std::uint32_t e : elementsRound(X))
        for (std::uint32_t t = 0; t < std::uint32_t(cellTets(elements()[e].shape).count); ++t) {
            if (elements()[e].fraction[t] <= most) continue;
            const EmbeddedPoint point = embed(e, t, X);
            if (!near.empty() &&
                std::find_first_of(near.begin(), near.end(), point.node.begin(), point.node.end()) == near.end())
                continue;
            if (!point.isInTet()) continue;
            best = {e, t, point};
            most = elements()[e].fraction[t];
        }
    return best;
}

double sumOfVolumes(const BodyMesh& mesh)
{
    const auto& elements = mesh.elements();
    return orderedSum(elements.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) sum += mesh.volume(elements[i]);
        return sum;
    });
}

std::vector<Vec3> restPositions(const BodyMesh& mesh)
{
    std::vector<Vec3> X(mesh.nodeCount());
    for (std::size_t i = 0; i < X.size(); ++i) X[i] = mesh.restPosition(i);
    return X;
}

Surface deform(const EmbeddedSurface& embedded, std::span<const Vec3> x, std::span<const std::uint32_t> fragmentOfNode)
{
    Surface surface;
    surface.points.resize(embedded.points.size());
    parallelChunks(embedded.points.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) surface.points[i] = embedded.points[i].at(x);
    });
    surface.triangles = embedded.triangles;
    surface.torn = embedded.torn;
    surface.fragment.resize(embedded.triangles.size());
    for (std::size_t i = 0; i < surface.fragment.size(); ++i)
        surface.fragment[i] = fragmentOfNode[embedded.points[embedded.triangles[i][0]].node[0]];
    return surface;
}

}  // namespace vdbfrac::tetmesh
