#include "fracture_arrivals.h"

#include <vdbfrac/tetmesh/nodes_around.h>

#include <cmath>
#include <limits>

namespace vdbfrac::effects {

grid::VoxelValues timesOf(const Arrivals& arrivals)
{
    grid::VoxelValues values;
    values.background = -1;
    for (const auto& [voxel, arrival] : arrivals) {
        values.coords.push_back(voxel);
        values.scalars.push_back(arrival.time);
    }
    return values;
}

grid::CrackPath pathOf(const Arrivals& arrivals, const tetmesh::NodeField<float>& phi)
{
    grid::CrackPath path(phi.lower(), phi.upper());
    for (const auto& [voxel, arrival] : arrivals) path.add(voxel, arrival.point);
    return path;
}

void save(const Arrivals& arrivals, const std::string& name, core::Archive& archive)
{
    const grid::VoxelValues times = timesOf(arrivals);
    std::vector<Vec3> points;
    for (const auto& [voxel, arrival] : arrivals) points.push_back(arrival.point);
    archive.put(name + ".arrival.voxels", times.coords);
    archive.put(name + ".arrival.times", times.scalars);
    archive.put(name + ".arrival.points", points);
}

Arrivals restoredArrivals(const std::string& name, const core::Body& body, const core::Archive& archive)
{
    const auto voxels = archive.get<Coord>(name + ".arrival.voxels");
    const auto times = archive.get<float>(name + ".arrival.times", voxels.size());
    const auto points = archive.get<Vec3>(name + ".arrival.points", voxels.size());
    Arrivals arrivals;
    for (std::size_t i = 0; i < voxels.size(); ++i) {
        if (!body.mesh->phi().contains(voxels[i]) || !std::isfinite(times[i]) || !points[i].allFinite())
            archive.complain("it lists a failed voxel outside body '" + body.name + "'");
        arrivals[voxels[i]] = {times[i], points[i]};
    }
    return arrivals;
}

Arrivals arrivalsOnFiner(const Arrivals& wide, const tetmesh::NodeField<float>& rest,
                         const tetmesh::NodeField<float>& now)
{
    constexpr int kReach = 3;  // wide voxels
    constexpr double kNone = std::numeric_limits<double>::infinity();
    Arrivals fine;
    if (wide.empty()) return fine;
    now.forEachBlock([&](Coord block) {
        now.forEachNode(block, [&](Coord n) {
            if (!(rest(n) < 0) || now(n) < 0) return;
            double nearest = kNone;
            Arrival found;
            const Coord middles[] = {{n.x >> 1, n.y >> 1, n.z >> 1}};
            for (const Coord& c : tetmesh::nodesAround(middles, kReach)) {
                const auto it = wide.find(c);
                if (it == wide.end()) continue;
                const double distance = ((2 * c) - n).toVec().squaredNorm();
                if (distance > nearest || (distance == nearest && it->second.time >= found.time)) continue;
                nearest = distance;
                found = {it->second.time, 2 * it->second.point};
            }
            if (nearest < kNone) fine.emplace(n, found);
        });
    });
    return fine;
}

}  // namespace vdbfrac::effects
