#include <vdbfrac/grid/phi_sampler.h>

#include "interpolant.h"
#include "openvdb_access.h"

#include <vdbfrac/grid/phi_nodes.h>

#include <openvdb/tools/Interpolation.h>

namespace vdbfrac::grid {

std::function<double(const Vec3&)> phiSampler(const LevelSet& phi)
{
    const openvdb::FloatGrid::ConstPtr grid = phi.grid().grid;
    return [grid, scale = 1 / phi.voxelSize()](const Vec3& X) -> double {
        // An accessor that the tree does not know costs nothing to make, and each call has its own.
        const openvdb::FloatGrid::ConstUnsafeAccessor voxels(grid->tree());
        return openvdb::tools::BoxSampler::sample(voxels, openvdb::Vec3d(X.x(), X.y(), X.z()) * scale);
    };
}

std::function<void(std::span<const Vec3> X, std::span<double> phi)> cubicPhiSampler(const LevelSet& phi)
{
    return [grid = openvdb::FloatGrid::ConstPtr(phi.grid().grid)](std::span<const Vec3> X, std::span<double> values) {
        Interpolant voxels(*grid);
        const double dx = grid->voxelSize()[0];
        for (std::size_t i = 0; i < X.size(); ++i) values[i] = voxels.valueAt(X[i] / dx);
    };
}

Bounds materialBox(const LevelSet& phi)
{
    const openvdb::CoordBBox box = materialVoxels(*phi.grid().grid);
    if (box.empty()) return {Vec3::Ones(), -Vec3::Ones()};
    const Vec3 room = Vec3::Constant(2);
    return {phi.voxelSize() * (fromVdb(box.min()).toVec() - room),
            phi.voxelSize() * (fromVdb(box.max()).toVec() + room)};
}

}  // namespace vdbfrac::grid
