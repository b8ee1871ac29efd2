#include <vdbfrac/grid/phi_nodes.h>

#include "openvdb_access.h"
#include "relevel_window.h"

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/tetmesh/nodes_around.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

namespace vdbfrac::grid {

namespace {

using Grid = openvdb::FloatGrid;
using Leaf = Grid::TreeType::LeafNodeType;

openvdb::Coord leafOrigin(const openvdb::Coord& c) { return {c.x() & ~7, c.y() & ~7, c.z() & ~7}; }

/// Origins, sorted, of the leaves that hold a voxel within `reach` <= 8 of a change: as far as the band goes, and one
/// more.
std::vector<openvdb::Coord> touchedLeaves(const PhiChanges& raised, int reach)
{
    std::vector<openvdb::Coord> leaves;
    const openvdb::Coord all(reach, reach, reach);
    for (const auto& [voxel, value] : raised) {
        const openvdb::Coord first = leafOrigin(toVdb(voxel) - all), last = leafOrigin(toVdb(voxel) + all);
        for (int x = first.x(); x <= last.x(); x += 8)
            for (int y = first.y(); y <= last.y(); y += 8)
                for (int z = first.z(); z <= last.z(); z += 8) leaves.emplace_back(x, y, z);
    }
    sortUnique(leaves);
    return leaves;
}

/// Bytes that a body takes for each leaf of the box, material or not: phi, phi at rest, cells and lattice nodes of its
/// mesh, and half a dozen fields of what may tear while that is looked for.
constexpr double kBytesPerLeafOfBox = 10 * 4;
constexpr double kMaxLeavesOfBox = 1 << 30;                 // they are numbered with 32 bits
constexpr int kMaxAlong = (1 << tetmesh::kPlaceBits) - 64;  // voxels, with some room beside the box

void requireBox(Coord lower, Coord upper, std::uint64_t memoryLimit)
{
    const auto along = [](int low, int high) { return (high >> 3) - (low >> 3) + 1.; };
    const double leaves = along(lower.x, upper.x) * along(lower.y, upper.y) * along(lower.z, upper.z);
    const Coord size = upper - lower;
    const std::string box = "the box of the material has " + std::to_string(size.x) + " x " + std::to_string(size.y) +
                            " x " + std::to_string(size.z) + " voxels",
                      remedy = "; use a larger voxel size, or look for parts that are far apart";
    if (leaves > kMaxLeavesOfBox || leaves * kBytesPerLeafOfBox > double(memoryLimit))
        throw LimitError(box + " and takes " + shortNumber(leaves * kBytesPerLeafOfBox / 1e9) +
                         " GB, the memory limit is " + shortNumber(double(memoryLimit) / 1e9) + " GB" + remedy);
    if (std::max({size.x, size.y, size.z}) > kMaxAlong)
        throw LimitError(box + ", at most " + std::to_string(kMaxAlong) + " along an axis can be numbered" + remedy);
}

}  // namespace

tetmesh::NodeField<float> sampleNodes(const LevelSet& phi, std::uint64_t memoryLimit)
{
    const Grid& grid = *phi.grid().grid;
    const openvdb::CoordBBox box = materialVoxels(grid);
    if (box.empty()) throw Error("the level set holds no material");
    const Coord grow{3, 3, 3};
    const Coord lower = fromVdb(box.min()) - grow, upper = fromVdb(box.max()) + grow;
    requireBox(lower, upper, memoryLimit);
    tetmesh::NodeField<float> nodes(lower, upper, grid.background(), -grid.background());
    for (int z = lower.z & ~7; z <= upper.z; z += 8)
        for (int y = lower.y & ~7; y <= upper.y; y += 8)
            for (int x = lower.x & ~7; x <= upper.x; x += 8) {
                const openvdb::Coord origin(x, y, z);
                if (const Leaf* leaf = grid.constTree().probeConstLeaf(origin)) {
                    for (openvdb::Index i = 0; i < Leaf::SIZE; ++i)
                        nodes.set(fromVdb(leaf->offsetToGlobalCoord(i)), leaf->getValue(i));
                } else if (grid.constTree().getValue(origin) < 0)
                    nodes.fillInside({x, y, z});
            }
    return nodes;
}

std::vector<VoxelPhi> sampleBand(const LevelSet& phi, std::span<const Coord> voxels)
{
    auto accessor = phi.grid().grid->getConstAccessor();
    std::vector<VoxelPhi> band;
    for (const Coord& c : voxels) {
        float value = 0;
        if (accessor.probeValue(toVdb(c), value)) band.push_back({c, value});
    }
    return band;
}

PhiChanges holeRound(Coord middle, double radius, double voxelSize)
{
    PhiChanges hole;
    for (const Coord& c : tetmesh::nodesAround({&middle, 1}, 3))
        hole.emplace_back(c, float(radius - voxelSize * (c.toVec() - middle.toVec()).norm()));
    return hole;
}

PhiChanges raiseAndRelevel(LevelSet& phi, const PhiChanges& raised, RelevelWork& work, const Relevelling& how)
{
    Grid& grid = *phi.grid().grid;
    const float background = grid.background();
    const std::vector<openvdb::Coord> touched =
        touchedLeaves(raised, std::min(8, int(std::lround(background / grid.voxelSize()[0])) + 1));
    std::vector<Leaf*> leaves;
    for (const openvdb::Coord& origin : touched) leaves.push_back(grid.tree().touchLeaf(origin));
    std::vector<RelevelWindow::Values> before(leaves.size());
    for (std::size_t n = 0; n < leaves.size(); ++n)
        std::copy_n(leaves[n]->buffer().data(), Leaf::SIZE, before[n].begin());

    auto accessor = grid.getAccessor();
    for (const auto& [voxel, value] : raised) {
        const openvdb::Coord c = toVdb(voxel);
        accessor.setValue(c, std::max(accessor.getValue(c), std::min(value, background)));
    }
    RelevelWindow window(grid, touched);
    if (how.sweeps > 0) window.settleInterface();
    std::vector<RelevelWindow::Values> settled(leaves.size());
    for (std::size_t n = 0; n < leaves.size(); ++n) settled[n] = window.values(n);
    for (int k = 0; k < how.sweeps; ++k) how.firstOrder ? window.sweep<FirstOrder>() : window.sweep<Weno5>();

    PhiChanges changes;
    for (std::size_t n = 0; n < leaves.size(); ++n)
        for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
            float value = settled[n][i];
            const float levelled = std::clamp(window.values(n)[i], -background, background);
            if (levelled > value && (levelled < 0) == (value < 0) && !window.beside(n)[i]) value = levelled;
            leaves[n]->setValueOnly(i, value);
            leaves[n]->setActiveState(i, std::abs(value) < background);
            if (value != before[n][i]) changes.emplace_back(fromVdb(leaves[n]->offsetToGlobalCoord(i)), value);
        }
    if (how.sweeps > 0)
        work.leaves += std::int64_t(touched.size()), work.voxels += std::int64_t(touched.size() * Leaf::SIZE);
    return changes;
}

void follow(std::span<VoxelPhi> band, const PhiChanges& changes)
{
    for (const auto& [voxel, value] : changes) {
        const auto it = std::ranges::lower_bound(band, voxel, {}, &VoxelPhi::voxel);
        if (it != band.end() && it->voxel == voxel) it->phi = value;
    }
}

BandLeaves bandLeaves(const LevelSet& phi)
{
    static_assert(BandLeaves::kVoxels == Leaf::SIZE);
    BandLeaves all;
    for (auto leaf = phi.grid().grid->constTree().cbeginLeaf(); leaf; ++leaf) {
        all.origins.push_back(fromVdb(leaf->origin()));
        all.values.insert(all.values.end(), leaf->buffer().data(), leaf->buffer().data() + Leaf::SIZE);
        for (openvdb::Index w = 0; w < BandLeaves::kWords; ++w)
            all.active.push_back(leaf->valueMask().getWord<std::uint64_t>(w));
    }
    return all;
}

PhiChanges setBandLeaves(LevelSet& phi, const BandLeaves& leaves)
{
    Grid& grid = *phi.grid().grid;
    constexpr int kReach = 16;  // voxels: re-levelling touches the leaves round a change
    openvdb::CoordBBox near;
    grid.constTree().evalLeafBoundingBox(near);
    near.expand(kReach);
    std::set<openvdb::Coord> seen;
    PhiChanges changes;
    for (std::size_t n = 0; n < leaves.origins.size(); ++n) {
        const openvdb::Coord origin = toVdb(leaves.origins[n]);
        const bool there = near.isInside(origin) || grid.constTree().probeConstLeaf(origin);
        if (!there || origin != leafOrigin(origin) || !seen.insert(origin).second)
            throw Error("a leaf of phi lies outside the level set");
        Leaf& leaf = *grid.tree().touchLeaf(origin);
        const float* values = leaves.values.data() + n * Leaf::SIZE;
        for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
            const float before = leaf.getValue(i);
            if (!(values[i] >= before && values[i] <= grid.background()))
                throw Error("phi is lower than at the start, or beyond its band");
            if (values[i] != before) changes.emplace_back(fromVdb(leaf.offsetToGlobalCoord(i)), values[i]);
            leaf.setValueOnly(i, values[i]);
            leaf.setActiveState(i, leaves.active[n * BandLeaves::kWords + i / 64] >> (i % 64) & 1);
        }
    }
    return changes;
}

}  // namespace vdbfrac::grid
