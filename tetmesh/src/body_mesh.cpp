#include "body_volume.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/body_mesh.h>

namespace vdbfrac::tetmesh {

double BodyMesh::volume(const CellElement& element) const
{
    const CellTets& tets = cellTets(element.shape);
    double sum = 0;
    for (int t = 0; t < tets.count; ++t) sum += tets.volume[std::size_t(t)] * element.fraction[std::size_t(t)];
    const double h = spacing();
    return h * h * h * sum;
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
