// Re-levelling: its sweeps are OpenVDB's, to the bit; what it may change, and what not.
#include "openvdb_access.h"
#include "relevel_window.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/phi_nodes.h>

#include <openvdb/tools/LevelSetSphere.h>
#include <openvdb/tools/LevelSetTracker.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

using namespace vdbfrac;
using grid::LevelSet;
using grid::RelevelWindow;
using Grid = openvdb::FloatGrid;
using Leaf = Grid::TreeType::LeafNodeType;

namespace {

constexpr float kDx = 0.1f;

/// A ball whose voxels near one side are raised, as by a front.
Grid::Ptr dentedBall()
{
    Grid::Ptr grid = openvdb::tools::createLevelSetSphere<Grid>(1.7f, openvdb::Vec3f(0.02f, -0.03f, 0.01f), kDx, 3);
    std::mt19937 random(5);
    std::uniform_real_distribution<float> raise(0, 0.6f * kDx);
    for (auto v = grid->beginValueOn(); v; ++v) {
        if (v.getCoord().x() > 11) v.setValue(std::min(*v + raise(random), grid->background()));
        if (std::abs(*v) >= grid->background()) v.setValueOff();
    }
    return grid;
}

/// All leaves with x at or above 8: some at the edge of the band, with tiles round them.
std::vector<openvdb::Coord> leavesOfOneSide(const Grid& grid)
{
    std::vector<openvdb::Coord> origins;
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf)
        if (leaf->origin().x() >= 8) origins.push_back(leaf->origin());
    std::sort(origins.begin(), origins.end());
    return origins;
}

/// The same window as a grid of its own: the leaves free to move, in a ring of leaves that hold still.
Grid::Ptr windowGrid(const Grid& grid, const std::vector<openvdb::Coord>& free)
{
    auto window = Grid::create(grid.background());
    window->setTransform(grid.transform().copy());
    window->setGridClass(openvdb::GRID_LEVEL_SET);
    for (const openvdb::Coord& origin : free)
        for (int n = 0; n < 27; ++n) {
            const openvdb::Coord at = origin.offsetBy(8 * (n / 9 - 1), 8 * (n / 3 % 3 - 1), 8 * (n % 3 - 1));
            if (window->tree().probeLeaf(at)) continue;
            const Leaf* leaf = grid.constTree().probeConstLeaf(at);
            auto* copy = leaf ? new Leaf(*leaf) : new Leaf(at, grid.constTree().getValue(at), false);
            std::binary_search(free.begin(), free.end(), at) ? copy->setValuesOn() : copy->setValuesOff();
            window->tree().addLeaf(copy);  // the tree owns it
        }
    return window;
}

TEST(Relevel, SweepsHaveTheBitsOfTheTracker)
{
    const Grid::Ptr grid = dentedBall();
    const std::vector<openvdb::Coord> free = leavesOfOneSide(*grid);
    ASSERT_GT(free.size(), 8u);
    const Grid::Ptr reference = windowGrid(*grid, free);
    for (int threads : {1, 3}) {
        const ThreadLimit limit(threads);
        const Grid::Ptr expected = reference->deepCopy();
        openvdb::tools::LevelSetTracker<Grid> tracker(*expected);
        tracker.setSpatialScheme(openvdb::math::HJWENO5_BIAS);
        tracker.setTemporalScheme(openvdb::math::TVD_RK1);
        tracker.setNormCount(1);
        RelevelWindow window(*grid, free);
        for (int sweep = 1; sweep <= 4; ++sweep) {
            tracker.normalize();
            window.sweep<grid::Weno5>();
            for (std::size_t n = 0; n < free.size(); ++n) {
                const Leaf& leaf = *expected->constTree().probeConstLeaf(free[n]);
                for (openvdb::Index i = 0; i < Leaf::SIZE; ++i)
                    ASSERT_EQ(window.values(n)[i], leaf.getValue(i)) << sweep << " " << leaf.offsetToGlobalCoord(i);
            }
        }
    }
}

TEST(Relevel, VoxelsBesideTheSurfaceAreThoseWithANeighbourOnItsOtherSide)
{
    const Grid::Ptr grid = dentedBall();
    const std::vector<openvdb::Coord> free = leavesOfOneSide(*grid);
    RelevelWindow window(*grid, free);
    window.settleInterface();
    const auto phi = grid->getConstAccessor();
    std::size_t found = 0, settled = 0;
    for (std::size_t n = 0; n < free.size(); ++n)
        for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
            const openvdb::Coord c = free[n] + Leaf::offsetToLocalCoord(i);
            const float value = phi.getValue(c);
            bool other = false;
            for (int k = 0; k < 27; ++k)
                other = other || (phi.getValue(c.offsetBy(k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1)) < 0) != (value < 0);
            EXPECT_EQ(window.beside(n)[i], other) << c;
            found += other;
            EXPECT_GE(window.values(n)[i], value) << c;  // no value falls
            if (!other || value >= 0) {
                EXPECT_EQ(window.values(n)[i], value) << c;
            }
            settled += window.values(n)[i] > value;
        }
    EXPECT_GT(found, 100u);
    EXPECT_GT(settled, 10u);
}

TEST(Relevel, TellsEveryChangeAndOnlyRaises)
{
    LevelSet phi = grid::wrap(dentedBall());
    const Grid::Ptr before = phi.grid().grid->deepCopy();
    grid::PhiChanges raised;
    for (auto v = before->cbeginValueOn(); v; ++v)
        if (v.getCoord().x() > 12 && *v < 0) raised.emplace_back(grid::fromVdb(v.getCoord()), *v + 0.4f * kDx);
    ASSERT_GT(raised.size(), 20u);
    grid::RelevelWork work;
    const grid::PhiChanges changes = grid::raiseAndRelevel(phi, raised, work);
    EXPECT_EQ(work.voxels, work.leaves * 512);
    std::map<Coord, float> changed;
    for (const auto& [voxel, phi] : changes) changed.emplace(voxel, phi);
    EXPECT_EQ(changed.size(), changes.size());
    const auto old = before->getConstAccessor(), now = phi.grid().grid->getConstAccessor();
    for (const auto& [voxel, value] : raised)
        EXPECT_GE(now.getValue(grid::toVdb(voxel)), std::min(value, before->background()));
    for (auto ijk = before->evalActiveVoxelBoundingBox().begin(); ijk; ++ijk) {
        const auto it = changed.find(grid::fromVdb(*ijk));
        EXPECT_EQ(it != changed.end(), now.getValue(*ijk) != old.getValue(*ijk)) << *ijk;
        if (it != changed.end()) {
            EXPECT_EQ(it->second, now.getValue(*ijk));
        }
        EXPECT_GE(now.getValue(*ijk), old.getValue(*ijk));
        EXPECT_EQ(now.isValueOn(*ijk), std::abs(now.getValue(*ijk)) < before->background()) << *ijk;
    }
}

/// A front that moves in two parts goes on, in the second, from what the first has made of phi.
TEST(Relevel, ABandFollowsTheGrid)
{
    LevelSet phi = grid::wrap(dentedBall());
    std::vector<Coord> voxels;
    grid::PhiChanges raised;
    for (int y = -6; y <= 6; ++y)
        for (int x = 8; x <= 20; ++x) voxels.push_back({x, y, 2});
    std::sort(voxels.begin(), voxels.end());
    std::vector<VoxelPhi> band = grid::sampleBand(phi, voxels);
    const std::vector<VoxelPhi> before = band;
    for (const VoxelPhi& b : band)
        if (b.voxel.y == 0) raised.emplace_back(b.voxel, b.phi + 0.4f * kDx);
    grid::RelevelWork work;
    grid::follow(band, grid::raiseAndRelevel(phi, raised, work));
    int moved = 0, beside = 0;
    for (std::size_t i = 0; i < band.size(); ++i) {
        EXPECT_EQ(band[i].phi, phi.grid().grid->tree().getValue(grid::toVdb(band[i].voxel)));
        moved += band[i].phi != before[i].phi;
        beside += band[i].phi != before[i].phi && band[i].voxel.y != 0;
    }
    EXPECT_GT(moved, 5);
    EXPECT_GT(beside, 0) << "re-levelling moved none but those that were raised";
}

}  // namespace
