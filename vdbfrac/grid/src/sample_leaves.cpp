#include "sample_leaves.h"

#include <vdbfrac/base/parallel.h>

#include <openvdb/tools/Prune.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::grid {

namespace {

constexpr int kLeafDim = 8;

/// Finds the leaves within `band` of the zero of a distance, by descending an octree.
class LeafSearch {
public:
    LeafSearch(const Build& build, const LeafBox& box, const Distance& distance)
        : build_(build), box_(box), distance_(distance), dx_(build.grid.voxelSize), band_(build.grid.halfWidth * dx_)
    {
        maxLeaves_ = double(build.memoryLimit) / kBytesPerLeaf;
    }

    std::vector<openvdb::Coord> run()
    {
        int size = kLeafDim;
        const openvdb::Coord extent = box_.upper - box_.lower;
        while (size < std::max({extent.x(), extent.y(), extent.z()})) size *= 2;
        visit(box_.lower, size);
        return std::move(found_);
    }

private:
    void visit(const openvdb::Coord& origin, int size)
    {
        for (int a = 0; a < 3; ++a)
            if (origin[a] >= box_.upper[a]) return;
        const double toCenter = 0.5 * (size - 1);
        const Vec3 center = dx_ * (fromVdb(origin).toVec() + Vec3::Constant(toCenter));
        // Half a voxel more than needed, against rounding.
        if (std::abs(distance_(center)) > std::sqrt(3.) * dx_ * toCenter + band_ + 0.5 * dx_) return;
        if (size == kLeafDim) {
            found_.push_back(origin);
            if (double(found_.size()) > maxLeaves_) requireMemory(build_, double(found_.size()) * kBytesPerLeaf);
            return;
        }
        const int half = size / 2;
        for (int c = 0; c < 8; ++c) visit(origin.offsetBy((c & 1) * half, (c >> 1 & 1) * half, (c >> 2) * half), half);
    }

    const Build& build_;
    LeafBox box_;
    const Distance& distance_;
    double dx_, band_, maxLeaves_;
    std::vector<openvdb::Coord> found_;
};

}  // namespace

LeafBox leafBox(const Bounds& bounds, double dx)
{
    LeafBox box;
    for (int a = 0; a < 3; ++a) {
        box.lower[a] = int(std::floor(bounds.lower[a] / dx / kLeafDim)) * kLeafDim;
        box.upper[a] = (int(std::floor(bounds.upper[a] / dx / kLeafDim)) + 1) * kLeafDim;
    }
    return box;
}

std::vector<openvdb::Coord> leavesNear(const Distance& distance, const LeafBox& box, const Build& build)
{
    return LeafSearch(build, box, distance).run();
}

openvdb::FloatGrid::Ptr sampleLeaves(const scene::Grid& spec, const std::vector<openvdb::Coord>& origins,
                                     const std::function<Sampler()>& makeSampler)
{
    using Leaf = openvdb::FloatTree::LeafNodeType;
    constexpr std::size_t kLeafChunk = 16;
    auto grid = makeLevelSetGrid(spec.voxelSize, spec.halfWidth);
    const float background = grid->background();
    std::vector<Leaf*> leaves(origins.size());
    parallelChunks(origins.size(), kLeafChunk, [&](std::size_t begin, std::size_t end) {
        const Sampler phi = makeSampler();
        for (std::size_t i = begin; i < end; ++i) {
            leaves[i] = new Leaf(origins[i], background);
            for (openvdb::Index v = 0; v < Leaf::SIZE; ++v) {
                const float value = float(phi(leaves[i]->offsetToGlobalCoord(v)));
                if (std::abs(value) < background)
                    leaves[i]->setValueOn(v, value);
                else
                    leaves[i]->setValueOff(v, std::copysign(background, value));
            }
        }
    });
    for (Leaf* leaf : leaves) grid->tree().addLeaf(leaf);
    openvdb::tools::signedFloodFill(grid->tree());
    openvdb::tools::pruneLevelSet(grid->tree());
    return grid;
}

}  // namespace vdbfrac::grid
