#include <vdbfrac/grid/voxel_values.h>

#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace vdbfrac::grid {

std::vector<float> sample(const VoxelValues& values, double voxelSize, std::span<const Vec3> X)
{
    std::vector<std::uint32_t> order(values.coords.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](auto a, auto b) { return values.coords[a] < values.coords[b]; });
    const auto find = [&](Coord c) -> const float* {
        const auto it = std::lower_bound(order.begin(), order.end(), c,
                                         [&](std::uint32_t i, Coord key) { return values.coords[i] < key; });
        return it != order.end() && values.coords[*it] == c ? &values.scalars[*it] : nullptr;
    };
    std::vector<float> at(X.size(), values.background);
    parallelChunks(X.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Vec3 p = X[i] / voxelSize;
            const Vec3 low(std::floor(p.x()), std::floor(p.y()), std::floor(p.z())), f = p - low;
            const Coord first{int(low.x()), int(low.y()), int(low.z())};
            double sum = 0, share = 0;
            for (int k = 0; k < 8; ++k) {
                const Coord step{k & 1, k >> 1 & 1, k >> 2};
                const float* const value = find(first + step);
                if (!value) continue;
                const double w =
                    (step.x ? f.x() : 1 - f.x()) * (step.y ? f.y() : 1 - f.y()) * (step.z ? f.z() : 1 - f.z());
                sum += w * *value, share += w;
            }
            if (share > 0) at[i] = float(sum / share);
        }
    });
    return at;
}

}  // namespace vdbfrac::grid
