#include <vdbfrac/grid/voxel_values.h>

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/node_field.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace vdbfrac::grid {

std::vector<float> sample(const VoxelValues& values, double voxelSize, std::span<const Vec3> X)
{
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    Coord lower{}, upper{};
    if (!values.coords.empty()) lower = upper = values.coords[0];
    for (const Coord& c : values.coords) {
        lower = {std::min(lower.x, c.x), std::min(lower.y, c.y), std::min(lower.z, c.z)};
        upper = {std::max(upper.x, c.x), std::max(upper.y, c.y), std::max(upper.z, c.z)};
    }
    tetmesh::NodeField<float> field(lower, upper, kNone, kNone);
    for (std::size_t i = 0; i < values.coords.size(); ++i) field.set(values.coords[i], values.scalars[i]);
    std::vector<float> at(X.size(), values.background);
    parallelChunks(X.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Vec3 p = X[i] / voxelSize;
            const Coord first = tetmesh::floorOf(p);
            double sum = 0, share = 0;
            for (int k = 0; k < tetmesh::kCorners; ++k) {
                const float value = field(first + tetmesh::cornerOffset(k));
                if (std::isnan(value)) continue;
                const double w = tetmesh::trilinearShare(k, p - first.toVec());
                sum += w * value, share += w;
            }
            if (share > 0) at[i] = float(sum / share);
        }
    });
    return at;
}

}  // namespace vdbfrac::grid
