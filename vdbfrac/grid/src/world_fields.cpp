#include <vdbfrac/grid/world_fields.h>

#include "openvdb_access.h"
#include "surface_band.h"

#include <openvdb/tools/SignedFloodFill.h>

#include <cmath>

namespace vdbfrac::grid {

namespace {

openvdb::FloatGrid::Ptr levelSetOf(const SurfaceBand& band, double voxelSize)
{
    using Leaf = openvdb::FloatTree::LeafNodeType;
    const openvdb::FloatGrid::Ptr grid = makeLevelSetGrid(voxelSize, SurfaceBand::kWidth);
    for (const SurfaceBand::Block& block : band.blocks) {
        Leaf* leaf = grid->tree().touchLeaf(toVdb(block.low));
        for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
            const float phi = float(voxelSize * double(block.phi[i]));
            if (block.closest[i] == SurfaceBand::kFar)
                leaf->setValueOff(i, std::copysign(grid->background(), phi));
            else
                leaf->setValueOn(i, phi);
        }
    }
    openvdb::tools::signedFloodFill(grid->tree());
    return grid;
}

}  // namespace

WorldFields worldFields(const tetmesh::Surface& surface, std::span<const Vec3> pointVelocity, double voxelSize)
{
    const SurfaceBand band = surfaceBand(surface, voxelSize);
    WorldFields fields;
    fields.fragment.background = -1;
    fields.velocity.isVector = true;
    for (const SurfaceBand::Block& block : band.blocks)
        for (int i = 0; i < SurfaceBand::kVoxels; ++i) {
            const std::uint32_t n = block.closest[std::size_t(i)];
            if (n == SurfaceBand::kFar) continue;
            const auto& t = surface.triangles[n];
            const Vec3 v = (pointVelocity[t[0]] + pointVelocity[t[1]] + pointVelocity[t[2]]) / 3;
            fields.velocity.coords.push_back(block.low + SurfaceBand::placeOf(i));
            fields.velocity.vectors.push_back(v.cast<float>());
            fields.fragment.scalars.push_back(float(surface.fragment[n]));
        }
    fields.fragment.coords = fields.velocity.coords;
    fields.surface = wrap(levelSetOf(band, voxelSize));
    return fields;
}

}  // namespace vdbfrac::grid
