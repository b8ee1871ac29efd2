#include "nodal_weights.h"

#include "coord_ranges.h"
#include "true_share.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/cell.h>

#include <Eigen/LU>

#include <algorithm>
#include <cmath>

namespace vdbfrac::tetmesh {

namespace {

using Barycentric = std::array<double, 4>;

/// Centroids of the parts^3 sub-tets of a tet.
std::vector<Barycentric> centroids(int parts)
{
    const DividedTet divided = divideTet(parts);
    std::vector<Barycentric> result(divided.tets.size(), Barycentric{});
    for (std::size_t t = 0; t < result.size(); ++t)
        for (std::uint16_t p : divided.tets[t])
            for (std::size_t a = 0; a < 4; ++a) result[t][a] += divided.points[p][a] / 4;
    return result;
}

struct VoxelVolume {
    Coord voxel;
    double volume;
};

/// Adds up equal voxels; sorted.
void addUp(std::vector<VoxelVolume>& shares)
{
    std::stable_sort(shares.begin(), shares.end(),
                     [](const VoxelVolume& a, const VoxelVolume& b) { return a.voxel < b.voxel; });
    std::size_t count = 0;
    for (const VoxelVolume& share : shares) {
        if (count > 0 && shares[count - 1].voxel == share.voxel)
            shares[count - 1].volume += share.volume;
        else
            shares[count++] = share;
    }
    shares.resize(count);
}

class Divider {
public:
    Divider(double voxelSize, int maxParts) : dx_(voxelSize)
    {
        for (int parts = 1; parts <= maxParts; ++parts) centroids_.push_back(centroids(parts));
    }

    /// What a tet gives to each voxel node.
    std::vector<VoxelVolume> shares(const std::array<Vec3, 4>& X) const
    {
        double longest = 0;
        for (std::size_t a = 0; a < 4; ++a)
            for (std::size_t b = 0; b < a; ++b) longest = std::max(longest, (X[a] - X[b]).norm());
        const std::size_t parts =
            std::clamp<std::size_t>(std::size_t(std::ceil(2 * longest / dx_)), 1, centroids_.size());
        const auto& samples = centroids_[parts - 1];
        Mat3 edges;
        for (Eigen::Index k = 0; k < 3; ++k) edges.col(k) = X[std::size_t(k) + 1] - X[0];
        const double volume = std::abs(edges.determinant()) / 6 / (dx_ * dx_ * dx_) / double(samples.size());
        std::vector<VoxelVolume> shares;
        shares.reserve(8 * samples.size());
        for (const Barycentric& b : samples)
            spread((b[0] * X[0] + b[1] * X[1] + b[2] * X[2] + b[3] * X[3]) / dx_, volume, shares);
        addUp(shares);
        return shares;
    }

private:
    static void spread(const Vec3& voxels, double volume, std::vector<VoxelVolume>& shares)
    {
        const Vec3 low = voxels.array().floor(), t = voxels - low;
        const Coord base{int(low.x()), int(low.y()), int(low.z())};
        for (int c = 0; c < kCorners; ++c) {
            const Coord o = cornerOffset(c);
            const double weight = (o.x ? t.x() : 1 - t.x()) * (o.y ? t.y() : 1 - t.y()) * (o.z ? t.z() : 1 - t.z());
            shares.push_back({base + o, volume * weight});
        }
    }

    double dx_;
    std::vector<std::vector<Barycentric>> centroids_;  // by parts - 1
};

}  // namespace

NodalWeights::NodalWeights(std::span<const Vec3> points, std::span<const std::array<std::uint32_t, 4>> tets,
                           double voxelSize)
{
    const Divider divider(voxelSize, kMaxParts);
    std::vector<std::vector<VoxelVolume>> ofTet(tets.size());
    parallelChunks(tets.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t t = begin; t < end; ++t)
            ofTet[t] = divider.shares({points[tets[t][0]], points[tets[t][1]], points[tets[t][2]], points[tets[t][3]]});
    });
    const auto some = std::ranges::find_if(ofTet, [](const auto& shares) { return !shares.empty(); });
    Coord lower = some == ofTet.end() ? Coord{} : some->front().voxel, upper = lower;
    for (const auto& shares : ofTet)
        for (const VoxelVolume& s : shares) {
            lower = {std::min(lower.x, s.voxel.x), std::min(lower.y, s.voxel.y), std::min(lower.z, s.voxel.z)};
            upper = {std::max(upper.x, s.voxel.x), std::max(upper.y, s.voxel.y), std::max(upper.z, s.voxel.z)};
        }
    number_ = NodeField<std::int32_t>(lower, upper, -1, -1);
    tetStart_ = {0};
    for (const auto& shares : ofTet) {
        for (const VoxelVolume& s : shares) {
            std::int32_t i = number_(s.voxel);
            if (i < 0) {
                number_.set(s.voxel, i = std::int32_t(voxels_.size()));
                voxels_.push_back(s.voxel);
            }
            voxelOfTet_.push_back(std::uint32_t(i));
        }
        tetStart_.push_back(voxelOfTet_.size());
    }
    start_.assign(voxels_.size() + 1, 0);
    for (std::uint32_t v : voxelOfTet_) ++start_[v + 1];
    for (std::size_t v = 0; v < voxels_.size(); ++v) start_[v + 1] += start_[v];
    weights_.resize(voxelOfTet_.size());
    std::vector<std::size_t> next(start_.begin(), start_.end() - 1);
    for (std::size_t t = 0; t < ofTet.size(); ++t)
        for (std::size_t k = 0; k < ofTet[t].size(); ++k)
            weights_[next[voxelOfTet_[tetStart_[t] + k]]++] = {std::uint32_t(t), float(ofTet[t][k].volume)};
}

}  // namespace vdbfrac::tetmesh
