// The leaves of a level set that are made a distance again, and those round them. Not installed.
//
// The sweeps are those of OpenVDB's LevelSetTracker::normalize with HJWENO5 and TVD_RK1, by OpenVDB's own difference
// formulas and to the same bits; but a leaf and what its stencils reach are first laid side by side, instead of looking
// every value up in the tree, and what is flat is not differentiated.
#pragma once

#include "openvdb_access.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <cstdint>
#include <vector>

namespace vdbfrac::grid {

/// One-sided differences of a line of voxels.
struct Weno5;
struct FirstOrder;

/// OpenVDB's sweeps compare differences of phi with constants, which mean nothing for voxels of a centimetre or more,
/// but weigh for smaller ones: for those they go by the size of voxels. So bodies of any size are levelled alike.
inline double constantsUnit(double voxelSize)
{
    constexpr double kMeaningless = 0.01;  // m
    return std::min(1., voxelSize / kMeaningless);
}

class RelevelWindow {
public:
    static constexpr int kLeaf = 512;  ///< voxels of a leaf, numbered as OpenVDB does: z fastest
    using Values = std::array<float, kLeaf>;

    /// `free`: origins of the leaves whose voxels may move, sorted; they exist in the grid. All round them holds still.
    RelevelWindow(const openvdb::FloatGrid& grid, const std::vector<openvdb::Coord>& free);

    /// Voxels beside the surface are not left to the sweeps, which would shift it a little on every call. Where phi is
    /// steeper than a distance, as just behind a front, the inside value is set to the distance that the edges show; on
    /// a true distance field this changes nothing.
    void settleInterface();
    /// One step of d phi/ds = S(phi) (1 - |grad phi|), S = phi / sqrt(phi^2 + |grad phi|^2), in all free leaves at
    /// once.
    template <class Differences>
    void sweep();

    const Values& values(std::size_t leaf) const { return values_[leaf]; }
    /// Voxels of a free leaf that have the surface between them and one of their 26 neighbours; after settleInterface.
    const std::bitset<kLeaf>& beside(std::size_t leaf) const { return beside_[leaf]; }

private:
    static constexpr int kReach = 3;  // of a stencil
    static constexpr int kWide = 8 + 2 * kReach;
    using Block = std::array<float, kWide * kWide * kWide>;  // a leaf and what is round it

    void gather(std::size_t leaf, Block& block) const;
    void settleLeaf(std::size_t leaf, const Block& block, Values& settled);
    template <class Differences>
    void sweepLeaf(const Block& block, Values& next) const;

    double dx_;         // m
    float background_;  // m
    std::size_t free_;  // number of leaves that may move; they come first
    std::vector<Values> values_;
    std::vector<std::array<std::uint32_t, 27>> round_;  // of each free leaf: those round it, x slowest
    std::vector<std::bitset<kLeaf>> beside_;
};

}  // namespace vdbfrac::grid
