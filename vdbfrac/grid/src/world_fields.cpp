#include <vdbfrac/grid/world_fields.h>

#include "openvdb_access.h"
#include "surface_solid.h"

namespace vdbfrac::grid {

WorldFields worldFields(const tetmesh::Surface& surface, std::span<const Vec3> pointVelocity, double voxelSize)
{
    SurfaceSolid solid = makeSurfaceSolid(surface, voxelSize);
    WorldFields fields;
    fields.fragment.background = -1;
    fields.velocity.isVector = true;
    for (auto it = solid.closest->cbeginValueOn(); it; ++it) {
        const std::size_t n = std::size_t(std::uint32_t(*it));
        if (n >= surface.triangles.size()) continue;
        const auto& t = surface.triangles[n];
        const Vec3 v = (pointVelocity[t[0]] + pointVelocity[t[1]] + pointVelocity[t[2]]) / 3;
        fields.velocity.coords.push_back(fromVdb(it.getCoord()));
        fields.velocity.vectors.push_back(v.cast<float>());
        fields.fragment.scalars.push_back(float(surface.fragment[n]));
    }
    fields.fragment.coords = fields.velocity.coords;
    fields.surface = LevelSet(std::make_unique<LevelSetGrid>(LevelSetGrid{solid.phi}));
    return fields;
}

}  // namespace vdbfrac::grid
