#include <vdbfrac/grid/distance_field.h>

#include "openvdb_access.h"

#include <vdbfrac/grid/body_level_set.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <openvdb/tools/FastSweeping.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace vdbfrac::grid {

struct DistanceField::Data {
    openvdb::FloatGrid::Ptr phi;
    double dx;
    Vec3 lower, upper;  // m: round all that is inside
};

namespace {

/// Carries phi on from its band to the middle, or as deep as nothing gets in a step, by fast sweeping.
openvdb::FloatGrid::Ptr filled(const openvdb::FloatGrid& band)
{
    const openvdb::Coord across = materialVoxels(band).dim();
    const int halfAcross = std::min({across.x() / 2, across.y() / 2, across.z() / 2, DistanceField::kDeepest}) + 1;
    return openvdb::tools::dilateSdf(band, halfAcross, openvdb::tools::NN_FACE, 1,
                                     openvdb::tools::FastSweepingDomain::SWEEP_LESS_THAN_ISOVALUE);
}

double deepestOf(const openvdb::FloatGrid& phi)
{
    float least = 0;
    for (auto leaf = phi.tree().cbeginLeaf(); leaf; ++leaf)
        for (auto v = leaf->cbeginValueOn(); v; ++v) least = std::min(least, *v);
    return -double(least);
}

/// Between voxels no value along an axis changes faster than between the voxels beside it.
double steepestOf(const openvdb::FloatGrid& phi, double dx)
{
    const openvdb::FloatGrid::ConstAccessor voxels(phi.tree());
    double most = 0;
    for (auto leaf = phi.tree().cbeginLeaf(); leaf; ++leaf)
        for (auto v = leaf->cbeginValueOn(); v; ++v)
            for (int side : {-1, 1})
                for (const openvdb::Coord& way :
                     {openvdb::Coord(side, 0, 0), openvdb::Coord(0, side, 0), openvdb::Coord(0, 0, side)})
                    most = std::max(most, std::abs(double(*v) - voxels.getValue(v.getCoord() + way)));
    return std::max(1., std::sqrt(3.) * most / dx);
}

}  // namespace

DistanceField::DistanceField(const scene::Collider& collider, const scene::Grid& grid, std::uint64_t memoryLimit)
{
    LevelSet band = makeLevelSet(collider, grid, memoryLimit);
    const openvdb::CoordBBox inside = materialVoxels(*band.grid().grid);
    // The surface is less than a voxel beyond.
    data_ = std::make_unique<Data>(Data{filled(*band.grid().grid), grid.voxelSize,
                                        grid.voxelSize * (fromVdb(inside.min()).toVec() - Vec3::Ones()),
                                        grid.voxelSize * (fromVdb(inside.max()).toVec() + Vec3::Ones())});
    deepest_ = deepestOf(*data_->phi), steepest_ = steepestOf(*data_->phi, grid.voxelSize);
}
DistanceField::DistanceField(DistanceField&&) noexcept = default;
DistanceField::~DistanceField() = default;

DistanceSample DistanceField::at(const Vec3& X) const
{
    const openvdb::FloatGrid::ConstUnsafeAccessor voxels(data_->phi->tree());
    const Vec3 at = X / data_->dx;
    const Coord low = tetmesh::floorOf(at);
    const Vec3 t = at - low.toVec();
    double value = 0;
    Vec3 gradient = Vec3::Zero();
    for (int c = 0; c < tetmesh::kCorners; ++c) {
        const Coord side = tetmesh::cornerOffset(c);
        const double phi = voxels.getValue(toVdb(low + side));
        value += tetmesh::trilinearShare(c, t) * phi;
        const Vec3 slope = 2 * side.toVec() - Vec3::Ones(), share = slope.cwiseProduct(t) + Vec3::Ones() - side.toVec();
        gradient += phi * Vec3(slope.x() * share.y() * share.z(), slope.y() * share.z() * share.x(),
                               slope.z() * share.x() * share.y());
    }
    constexpr double kRounding = 1e-5;  // of floats
    const Vec3 away = X - X.cwiseMax(data_->lower).cwiseMin(data_->upper);
    if (value >= (1 - kRounding) * data_->phi->background() && away.norm() > value)
        return {away.norm(), away.normalized()};
    return {value, gradient / data_->dx};
}

double DistanceField::thinShare() const
{
    constexpr double kThin = 1.75, kBack = -.85;  // voxels; cosine between the surfaces, of a wedge of 30 degrees
    const double dx = data_->dx;
    std::int64_t all = 0, thin = 0;
    for (auto leaf = data_->phi->tree().cbeginLeaf(); leaf; ++leaf)
        for (auto v = leaf->cbeginValueOn(); v; ++v) {
            if (std::abs(*v) > .5 * dx) continue;
            const Vec3 X = dx * fromVdb(v.getCoord()).toVec(), out = at(X).gradient.normalized();
            const DistanceSample deeper = at(X - (double(*v) + dx) * out);
            ++all;
            thin += deeper.value > -(kThin - 1) * dx && deeper.gradient.normalized().dot(out) < kBack;
        }
    return all > 0 ? double(thin) / double(all) : 0;
}

double DistanceField::across() const { return (data_->upper - data_->lower).maxCoeff(); }

std::size_t DistanceField::bytes() const { return data_->phi->memUsage(); }

}  // namespace vdbfrac::grid
