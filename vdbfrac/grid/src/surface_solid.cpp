#include "surface_solid.h"
#include "triangles.h"

#include <vdbfrac/base/error.h>

#include <utility>

namespace vdbfrac::grid {

namespace {

constexpr float kBand = 3;             // voxels
constexpr double kMaxReach = 1 << 20;  // a level set of more voxels along an axis is not worth its memory

void requireSane(const tetmesh::Surface& surface, double voxelSize)
{
    if (!(voxelSize > 0)) throw Error("the voxel size must be above 0");
    for (const Vec3& x : surface.points)
        if (!x.allFinite() || x.cwiseAbs().maxCoeff() > kMaxReach * voxelSize)
            throw Error("the surface has coordinates that are not finite, or too large for its voxel size");
    for (const auto& triangle : surface.triangles)
        for (std::uint32_t corner : triangle)
            if (corner >= surface.points.size()) throw Error("the surface has indices out of range");
}

}  // namespace

SurfaceSolid makeSurfaceSolid(const tetmesh::Surface& surface, double voxelSize)
{
    requireSane(surface, voxelSize);
    Triangles mesh;
    mesh.points.reserve(surface.points.size());
    for (const Vec3& x : surface.points) mesh.points.push_back(x / voxelSize);
    mesh.corners = surface.triangles;
    Voxelized made = voxelize(mesh, voxelSize, kBand, 0);
    return {std::move(made.phi), std::move(made.closest)};
}

}  // namespace vdbfrac::grid
