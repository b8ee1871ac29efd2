// Signed distances round a closed triangle surface, with the triangle each is to. Not installed.
//
// Distances are exact within a voxel; beyond they are those to the triangles closest to neighbours. A voxel is inside
// where the surface winds round it, by the triangles that a line from it along z crosses: material that overlaps is
// inside, a closed hollow is not. Voxels in gaps that are narrower than a voxel would be specks: they are inside,
// unless voxels beside each other lead out of the gap.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/surface.h>

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace vdbfrac::grid {

struct SurfaceBand {
    static constexpr int kEdge = 8, kVoxels = kEdge * kEdge * kEdge;
    static constexpr double kWidth = 3;  // voxels on either side
    static constexpr std::uint32_t kFar = std::numeric_limits<std::uint32_t>::max();

    /// A leaf of an OpenVDB tree, z fastest.
    struct Block {
        Coord low;                                   // its lowest voxel
        std::array<float, kVoxels> phi;              // voxels; +-kWidth beyond the band
        std::array<std::uint32_t, kVoxels> closest;  // triangle; kFar beyond the band
    };
    static Coord placeOf(int index) { return {index / kEdge / kEdge, index / kEdge % kEdge, index % kEdge}; }

    std::vector<Block> blocks;  // sorted
};

/// Throws Error on coordinates that are not finite or too large for the voxel size [m], and on indices out of range.
SurfaceBand surfaceBand(const tetmesh::Surface& surface, double voxelSize);

}  // namespace vdbfrac::grid
