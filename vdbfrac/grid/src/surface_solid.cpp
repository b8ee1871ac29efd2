#include "surface_solid.h"

#include <vdbfrac/base/error.h>

#include <openvdb/tools/MeshToVolume.h>

namespace vdbfrac::grid {

namespace {

constexpr float kBand = 3;                  // voxels
constexpr double kFarthestVoxel = 1 << 20;  // a level set of more voxels along an axis is not worth its memory

/// What tools::meshToVolume asks a mesh for, in voxels.
struct Triangles {
    const tetmesh::Surface& surface;
    double voxelSize;

    std::size_t polygonCount() const { return surface.triangles.size(); }
    std::size_t pointCount() const { return surface.points.size(); }
    std::size_t vertexCount(std::size_t) const { return 3; }
    void getIndexSpacePoint(std::size_t n, std::size_t v, openvdb::Vec3d& p) const
    {
        const Vec3 x = surface.points[surface.triangles[n][v]] / voxelSize;
        p = {x.x(), x.y(), x.z()};
    }
};

void requireSane(const tetmesh::Surface& surface, double voxelSize)
{
    if (!(voxelSize > 0)) throw Error("the voxel size must be above 0");
    for (const Vec3& x : surface.points)
        if (!x.allFinite() || x.cwiseAbs().maxCoeff() > kFarthestVoxel * voxelSize)
            throw Error("the surface has coordinates that are not finite, or too large for its voxel size");
    for (const auto& triangle : surface.triangles)
        for (std::uint32_t corner : triangle)
            if (corner >= surface.points.size()) throw Error("the surface has indices out of range");
}

}  // namespace

SurfaceSolid makeSurfaceSolid(const tetmesh::Surface& surface, double voxelSize)
{
    requireSane(surface, voxelSize);
    const auto transform = openvdb::math::Transform::createLinearTransform(voxelSize);
    auto closest = openvdb::Int32Grid::create(openvdb::util::INVALID_IDX);
    closest->setTransform(transform);
    auto phi = openvdb::tools::meshToVolume<openvdb::FloatGrid>(Triangles{surface, voxelSize}, *transform, kBand, kBand, 0, closest.get());
    phi->setGridClass(openvdb::GRID_LEVEL_SET);
    return {phi, closest};
}

}  // namespace vdbfrac::grid
