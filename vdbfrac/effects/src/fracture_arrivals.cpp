#include "fracture_arrivals.h"

#include <vdbfrac/tetmesh/nodes_around.h>

#include <algorithm>
#include <limits>
#include <utility>

namespace vdbfrac::effects {

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
            std::pair<double, float> nearest(kNone, 0);
            const Coord middles[] = {{n.x >> 1, n.y >> 1, n.z >> 1}};
            for (const Coord& c : tetmesh::nodesAround(middles, kReach))
                if (const auto it = wide.find(c); it != wide.end())
                    nearest = std::min(nearest, {((2 * c) - n).toVec().squaredNorm(), it->second});
            if (nearest.first < kNone) fine.emplace(n, nearest.second);
        });
    });
    return fine;
}

}  // namespace vdbfrac::effects
