// phi between the level set and the cut: sampled whole once, then only what changed.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/grid/level_set.h>
#include <vdbfrac/tetmesh/node_field.h>

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace vdbfrac::grid {

/// phi [m] on all voxel nodes of the material and three layers round it. Throws LimitError when the box of the material
/// takes more than `memoryLimit` [bytes] in the fields of a mesh that is cut by it: parts that lie far apart make it
/// large.
tetmesh::NodeField<float> sampleNodes(const LevelSet& phi, std::uint64_t memoryLimit = ~std::uint64_t{0});

/// phi [m] at voxels of the band; voxels that are not in the band (not active) are left out.
std::vector<VoxelPhi> sampleBand(const LevelSet& phi, std::span<const Coord> voxels);

/// New values of phi [m] at voxels.
using PhiChanges = std::vector<VoxelPhi>;

/// phi of a hole of this radius [m] round a voxel node, and three voxels round it.
PhiChanges holeRound(Coord middle, double radius, double voxelSize);

struct RelevelWork {
    std::int64_t leaves = 0;  ///< re-levelled
    std::int64_t voxels = 0;  ///< in them
};

/// How phi is made a distance again behind a front.
struct Relevelling {
    /// One-sided differences of first order instead of HJWENO5: cheaper, and wear the shape off.
    bool firstOrder = false;
    int sweeps = 3;  ///< each carries the distance by 0.3 voxels; 0 leaves phi as it was raised
};

/// Raises phi to the given values, then makes it a distance again in the leaves round them, by the sweeps of
/// tools::LevelSetTracker (HJWENO5, TVD_RK1), to its bits; the band follows the front. Voxels beside the surface move
/// only where phi is steeper than a distance, so on a distance field re-levelling moves no surface. No value falls:
/// material never grows. Returns every voxel whose value is not what it was before the call.
PhiChanges raiseAndRelevel(LevelSet& phi, const PhiChanges& raised, RelevelWork& work, const Relevelling& how = {});

/// Gives a band, by rising voxel, the values that changed.
void follow(std::span<VoxelPhi> band, const PhiChanges& changes);

/// The voxels of all leaves of a level set: with the tiles of the grid that it grew out of, all there is of it.
struct BandLeaves {
    static constexpr std::size_t kVoxels = 512, kWords = kVoxels / 64;
    std::vector<Coord> origins;         ///< lowest voxel of each leaf; all coordinates are multiples of 8
    std::vector<float> values;          ///< m, 512 a leaf, z fastest
    std::vector<std::uint64_t> active;  ///< a bit a voxel, 8 words a leaf
};
BandLeaves bandLeaves(const LevelSet& phi);
/// Makes `phi`, as it was at the start, the level set whose leaves these are. Returns every voxel whose value is not
/// what it was. Throws Error for leaves that no tearing leads to: far away, listed twice, with a value below that at
/// the start or beyond the band.
PhiChanges setBandLeaves(LevelSet& phi, const BandLeaves& leaves);

}  // namespace vdbfrac::grid
