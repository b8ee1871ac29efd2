#include <vdbfrac/lab/samples/surface_measures.h>

#include <Eigen/Geometry>

#include <cstdint>
#include <map>
#include <utility>

namespace vdbfrac::lab {

BadEdges badEdges(const tetmesh::EmbeddedSurface& surface)
{
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> count;
    for (const auto& t : surface.triangles)
        for (std::size_t k = 0; k < 3; ++k) ++count[{t[k], t[(k + 1) % 3]}];
    BadEdges bad;
    for (const auto& [edge, n] : count) {
        const auto reverse = count.find({edge.second, edge.first});
        bad.open += reverse == count.end() || reverse->second != n;
        bad.crowded += n != 1;
    }
    return bad;
}

double enclosedVolume(const tetmesh::BodyMesh& mesh)
{
    const auto surface = mesh.surface();
    const auto rest = tetmesh::restPositions(mesh);
    double volume = 0;
    for (const auto& t : surface.triangles)
        volume +=
            surface.points[t[0]].at(rest).dot(surface.points[t[1]].at(rest).cross(surface.points[t[2]].at(rest))) / 6;
    return volume;
}

}  // namespace vdbfrac::lab
