// A cut where a test wants it: material is parted without a load.
#pragma once

#include <vdbfrac/core/stages.h>
#include <vdbfrac/grid/phi_nodes.h>
#include <vdbfrac/tetmesh/node_field.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::test {

/// Takes a slab |x - at| < halfWidth away at the end of the first step. It joins where fracture does.
class Saw : public core::Effect, public core::GridStage {
public:
    Saw(double at, double halfWidth) : at_(at), halfWidth_(halfWidth) {}

    std::string name() const override { return "saw"; }
    void join(core::Stages& stages) override { stages.grid.push_back(this); }

    grid::PhiChanges update(const core::GridContext&, const core::Body& body, grid::LevelSet& grid) override
    {
        if (done_) return {};
        done_ = true;
        grid::PhiChanges raised;
        const tetmesh::NodeField<float>& phi = body.mesh->phi();
        phi.forEachBlock([&](Coord low) {
            phi.forEachNode(low, [&](Coord c) {
                const double slab = halfWidth_ - std::abs(body.phi.voxelSize() * c.x - at_);
                if (phi(c) < 0 && slab > phi(c)) raised.emplace_back(c, float(slab));
            });
        });
        grid::RelevelWork work;
        return grid::raiseAndRelevel(grid, raised, work);
    }

private:
    double at_, halfWidth_;  // m
    bool done_ = false;
};

}  // namespace vdbfrac::test
