#include "winding.h"

#include <vdbfrac/base/disjoint_sets.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/trilinear.h>
#include <vdbfrac/tetmesh/winding.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <vector>

namespace vdbfrac::skin {

using tetmesh::RenderMesh;

namespace {

/// Of each triangle of the fans, as its corners run [m^2].
std::vector<Vec3> areasOf(const RenderMesh& mesh, const tetmesh::Fans& fans)
{
    std::vector<Vec3> areas;
    const auto at = [&](std::uint32_t corner) { return mesh.points[mesh.corners[corner].point]; };
    for (const auto& t : fans.corners) areas.push_back(.5 * (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])));
    return areas;
}

/// How much phi grows from inside to outside of a triangle, over what a distance would: 1 where it is wound outward, -1
/// inward.
double growth(const tetmesh::BodyMesh& body, const Vec3& middle, const Vec3& normal)
{
    constexpr double kAside = .5;  // voxels
    const double dx = body.voxelSize();
    const auto phi = [&](double s) { return tetmesh::trilinear(body.restPhi(), Vec3(middle / dx + s * normal)); };
    return (phi(kAside) - phi(-kAside)) / (2 * kAside * dx);
}

}  // namespace

RenderMesh woundOutward(RenderMesh mesh, const tetmesh::BodyMesh& body)
{
    constexpr double kSure = .25;  // of the growth of a distance
    const tetmesh::Fans fans = tetmesh::fansOf(mesh);
    const std::vector<Vec3> areas = areasOf(mesh, fans);
    DisjointSets parts(mesh.points.size());
    for (const auto& t : fans.corners)
        for (int k : {1, 2}) parts.join(mesh.corners[t[0]].point, mesh.corners[t[std::size_t(k)]].point);
    std::vector<double> outwardOf(areas.size(), 0);  // m^2
    parallelChunks(areas.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t t = begin; t < end; ++t) {
            const double size = areas[t].norm();
            if (!(size > 0)) continue;
            Vec3 middle = Vec3::Zero();
            for (std::uint32_t c : fans.corners[t]) middle += mesh.points[mesh.corners[c].point] / 3;
            outwardOf[t] = size * growth(body, middle, areas[t] / size);
        }
    });
    std::vector<double> area(mesh.points.size(), 0), outward(area);  // of parts, by their least point
    for (std::size_t t = 0; t < areas.size(); ++t) {
        const std::uint32_t part = parts.find(mesh.corners[fans.corners[t][0]].point);
        area[part] += areas[t].norm(), outward[part] += outwardOf[t];
    }
    std::vector<std::uint8_t> isTurned(mesh.faces(), 0);
    for (std::size_t f = 0, begin = 0; f < mesh.faces(); begin = mesh.faceEnd[f++]) {
        const std::uint32_t part = parts.find(mesh.corners[begin].point);
        if (outward[part] >= -kSure * area[part]) continue;
        isTurned[f] = 1;
    }
    if (std::ranges::count(isTurned, 1) > 0) tetmesh::turnFaces(mesh, isTurned);
    return mesh;
}

}  // namespace vdbfrac::skin
