#include <vdbfrac/lab/scenes/saw.h>

#include <vdbfrac/grid/phi_nodes.h>
#include <vdbfrac/tetmesh/node_field.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::lab {

grid::PhiChanges Saw::update(const core::GridContext& context, const core::Body& body, grid::LevelSet& grid)
{
    if (done_ || context.time < time_) return {};
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

}  // namespace vdbfrac::lab
