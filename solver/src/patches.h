// The elements of a system, divided into patches. Not installed.
#pragma once

#include "kernel.h"

#include <vdbfrac/solver/elastic_operator.h>

#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::solver {

/// A block of cells: its batches, its nodes, and the slots it writes its sums to (one a node).
struct Patch {
    std::uint32_t firstBatch = 0, batches = 0;
    std::uint32_t firstSlot = 0, nodes = 0;  ///< slots of a patch begin at a multiple of kLanes
    std::uint32_t firstRun = 0, runs = 0;
    std::uint32_t firstElement = 0, elements = 0;
    double mu = 0, lambda = 0;  ///< Pa
    std::int64_t tets = 0;      ///< with material
    const Yield* yield = nullptr;
    /// One a node, and some that fill it up.
    std::size_t slots() const { return (nodes + kLanes - 1) / kLanes * kLanes; }
    std::size_t stride() const { return slots() + kLanes; }
};

struct Patches {
    std::vector<Patch> patches;
    std::vector<Batch> batches;
    std::vector<LaneCorners> corners;
    std::vector<LaneVolumes> volumes;
    std::vector<LaneTets> laneTets;
    std::vector<LaneCells> laneCells;
    std::vector<LaneYields> yields;            ///< of each batch; empty: nothing flows
    std::vector<std::uint32_t> laneOfElement;  ///< kLanes * batch + lane of each element of the system
    std::vector<NodeRun> runs;
    std::vector<std::uint32_t> slotStart, slots;  ///< slots of each node, by rising patch
    std::vector<std::uint32_t> contiguous;        ///< SlotSums
    std::int64_t tets = 0;
    std::size_t tangentCount = 0;  ///< tets of all batches and means of their cells, eight of them at a time
    std::size_t slotCount = 0, largestStride = 0;

    bool means = false;  ///< whether cells of more than one tet have a mean

    std::size_t tetsOf(std::size_t batch) const { return std::size_t(tetmesh::cellTets(batches[batch].shape).count); }
    /// Tangents of a batch: of its tets and, behind them, of their mean.
    std::size_t tangentsOf(std::size_t batch) const { return tetsOf(batch) + (means && tetsOf(batch) > 1); }
    std::size_t bytes() const;
};

/// Inverse flow of tet t of element e; null: none, or I.
inline const Mat3* inverseFlow(const ElementSet& set, std::size_t e, std::size_t t)
{
    if (!set.inverseFlow) return nullptr;
    const Mat3& own = (*set.inverseFlow)(e, t);
    return own == Mat3::Identity() ? nullptr : &own;
}

/// Factor on the stiffness of tet t of element e.
inline double stiffness(const ElementSet& set, std::size_t e, std::size_t t)
{
    return set.stiffness.empty() ? 1. : double(set.stiffness[tetmesh::tetEntry(e, t)]);
}

/// h grad N of the last three vertices of tet t of element e, carried on by its flow: h Fp^-T grad N.
tetmesh::TetGradients restGradients(const ElementSet& set, std::size_t e, std::size_t t);

/// `means`: with room for the tangent of the mean of each cell.
Patches makePatches(std::span<const ElementSet> sets, std::size_t nodeCount, bool means);

}  // namespace vdbfrac::solver
