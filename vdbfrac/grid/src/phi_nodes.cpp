#include <vdbfrac/grid/phi_nodes.h>

#include "openvdb_access.h"

#include <openvdb/tools/LevelSetTracker.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

namespace vdbfrac::grid {

namespace {

using Grid = openvdb::FloatGrid;
using Leaf = Grid::TreeType::LeafNodeType;

openvdb::Coord leafOrigin(const openvdb::Coord& c) { return {c.x() & ~7, c.y() & ~7, c.z() & ~7}; }

openvdb::CoordBBox materialBounds(const Grid& grid)
{
    openvdb::CoordBBox box;
    for (auto it = grid.cbeginValueOn(); it; ++it)
        if (*it < 0) box.expand(it.getBoundingBox());
    return box;
}

/// Leaves that hold a voxel within `reach` of a change: as far as the band goes, and one more.
std::set<openvdb::Coord> touchedLeaves(const PhiChanges& raised, int reach)
{
    std::set<openvdb::Coord> leaves;
    for (const auto& [voxel, value] : raised)
        for (int x = -reach; x <= reach; x += reach)  // steps of 8 or less skip no leaf
            for (int y = -reach; y <= reach; y += reach)
                for (int z = -reach; z <= reach; z += reach) leaves.insert(leafOrigin(toVdb(voxel).offsetBy(x, y, z)));
    return leaves;
}

/// The touched leaves with all voxels free to move, in a ring of leaves that hold still.
Grid::Ptr windowOf(const Grid& grid, const std::set<openvdb::Coord>& touched)
{
    auto window = Grid::create(grid.background());
    window->setTransform(grid.transform().copy());
    window->setGridClass(openvdb::GRID_LEVEL_SET);
    std::set<openvdb::Coord> ring;
    for (const openvdb::Coord& origin : touched)
        for (int x = -8; x <= 8; x += 8)
            for (int y = -8; y <= 8; y += 8)
                for (int z = -8; z <= 8; z += 8) ring.insert(origin.offsetBy(x, y, z));
    for (const openvdb::Coord& origin : ring) {
        const Leaf* leaf = grid.constTree().probeConstLeaf(origin);
        auto* copy = leaf ? new Leaf(*leaf) : new Leaf(origin, grid.constTree().getValue(origin), false);
        touched.count(origin) ? copy->setValuesOn() : copy->setValuesOff();
        window->tree().addLeaf(copy);  // the tree owns it
    }
    return window;
}

void makeDistance(Grid& window)
{
    using Tracker = openvdb::tools::LevelSetTracker<Grid>;
    constexpr int kSweeps = 3;
    Tracker tracker(window);
    tracker.setSpatialScheme(openvdb::math::HJWENO5_BIAS);
    tracker.setTemporalScheme(openvdb::math::TVD_RK1);
    tracker.setNormCount(kSweeps);
    tracker.normalize();
}

struct Crossing {
    bool near = false;   // some neighbour lies on the other side of the surface
    double nearest = 0;  // m: least distance to a crossing on an edge to a neighbour
};

/// How far the surface is from a voxel, seen along the edges to its 26 neighbours.
Crossing crossingNear(Grid::ConstAccessor& phi, const openvdb::Coord& c, double dx)
{
    const double value = phi.getValue(c);
    Crossing crossing{false, std::numeric_limits<double>::infinity()};
    for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
            for (int z = -1; z <= 1; ++z) {
                const double other = phi.getValue(c.offsetBy(x, y, z));
                if ((other < 0) == (value < 0)) continue;
                crossing.near = true;
                crossing.nearest = std::min(crossing.nearest, dx * std::sqrt(x * x + y * y + z * z) * value / (value - other));
            }
    return crossing;
}

/// Voxels beside the surface are not left to the tracker, which would shift it a little on every call. Where phi is
/// steeper than a distance, as just behind a front, the inside value is set to the distance that the edges show; on a
/// true distance field this changes nothing. Returns which voxels of the window are beside the surface.
std::set<openvdb::Coord> settleInterface(Grid& window, const std::set<openvdb::Coord>& touched)
{
    std::set<openvdb::Coord> beside;
    const Grid::Ptr before = window.deepCopy();
    auto still = before->getConstAccessor();
    auto accessor = window.getAccessor();
    for (const openvdb::Coord& origin : touched) {
        const Leaf& leaf = *before->constTree().probeConstLeaf(origin);
        for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
            if (std::abs(leaf.getValue(i)) >= window.background() && leaf.getValue(i) > 0) continue;
            const openvdb::Coord c = leaf.offsetToGlobalCoord(i);
            const Crossing crossing = crossingNear(still, c, window.voxelSize()[0]);
            if (!crossing.near) continue;
            beside.insert(c);
            if (leaf.getValue(i) < 0) accessor.setValue(c, std::max(leaf.getValue(i), float(-crossing.nearest)));
        }
    }
    return beside;
}

}  // namespace

tetmesh::NodeField<float> sampleNodes(const LevelSet& phi)
{
    const Grid& grid = *phi.grid().grid;
    const openvdb::CoordBBox box = materialBounds(grid);
    const Coord grow{3, 3, 3};
    const Coord lower = fromVdb(box.min()) - grow, upper = fromVdb(box.max()) + grow;
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

std::vector<BandSample> sampleBand(const LevelSet& phi, std::span<const Coord> voxels)
{
    auto accessor = phi.grid().grid->getConstAccessor();
    std::vector<BandSample> band;
    for (const Coord& c : voxels) {
        float value = 0;
        if (accessor.probeValue(toVdb(c), value)) band.push_back({c, value});
    }
    return band;
}

PhiChanges raiseAndRelevel(LevelSet& phi, const PhiChanges& raised, RelevelWork& work)
{
    Grid& grid = *phi.grid().grid;
    const float background = grid.background();
    const std::set<openvdb::Coord> touched = touchedLeaves(raised, std::min(8, int(std::lround(background / grid.voxelSize()[0])) + 1));
    std::map<openvdb::Coord, Leaf> before;
    for (const openvdb::Coord& origin : touched) before.emplace(origin, *grid.tree().touchLeaf(origin));

    auto accessor = grid.getAccessor();
    for (const auto& [voxel, value] : raised) {
        const openvdb::Coord c = toVdb(voxel);
        accessor.setValue(c, std::max(accessor.getValue(c), std::min(value, background)));
    }
    const Grid::Ptr window = windowOf(grid, touched);
    const std::set<openvdb::Coord> beside = settleInterface(*window, touched);
    const Grid::Ptr settled = window->deepCopy();
    makeDistance(*window);

    PhiChanges changes;
    for (const auto& [origin, old] : before) {
        Leaf& leaf = *grid.tree().probeLeaf(origin);
        const Leaf &start = *settled->constTree().probeConstLeaf(origin), &end = *window->constTree().probeConstLeaf(origin);
        for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
            const openvdb::Coord c = leaf.offsetToGlobalCoord(i);
            float value = start.getValue(i);
            const float levelled = std::clamp(end.getValue(i), -background, background);
            if (levelled > value && (levelled < 0) == (value < 0) && !beside.count(c)) value = levelled;
            leaf.setValueOnly(i, value);
            leaf.setActiveState(i, std::abs(value) < background);
            if (value != old.getValue(i)) changes.emplace_back(fromVdb(c), value);
        }
    }
    work.leaves += std::int64_t(touched.size());
    work.voxels += std::int64_t(touched.size() * Leaf::SIZE);
    return changes;
}

}  // namespace vdbfrac::grid
