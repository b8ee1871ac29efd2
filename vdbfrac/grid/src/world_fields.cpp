#include <vdbfrac/grid/world_fields.h>

#include "openvdb_access.h"
#include "surface_band.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/base/triangle.h>

#include <openvdb/tools/SignedFloodFill.h>

#include <array>
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

/// Of the point of a triangle that is closest to X [m].
Vec3 velocityAt(const tetmesh::Surface& surface, std::uint32_t triangle, std::span<const Vec3> pointVelocity,
                const Vec3& X)
{
    const auto& t = surface.triangles[triangle];
    const std::array<Vec3, 3> corners{surface.points[t[0]], surface.points[t[1]], surface.points[t[2]]};
    Vec3 share =
        sharesOf(corners, vdbfrac::closestPoint(corners, X).at).cwiseMax(0);  // of a needle, rounding leaves anything
    share /= share.sum();
    return share[0] * pointVelocity[t[0]] + share[1] * pointVelocity[t[1]] + share[2] * pointVelocity[t[2]];
}

}  // namespace

WorldFields worldFields(const tetmesh::Surface& surface, std::span<const Vec3> pointVelocity, double voxelSize)
{
    const SurfaceBand band = surfaceBand(surface, voxelSize);
    WorldFields fields;
    fields.fragment.background = -1;
    fields.velocity.isVector = true;
    std::vector<std::uint32_t> closest;
    for (const SurfaceBand::Block& block : band.blocks)
        for (int i = 0; i < SurfaceBand::kVoxels; ++i) {
            const std::uint32_t n = block.closest[std::size_t(i)];
            if (n == SurfaceBand::kFar) continue;
            closest.push_back(n);
            fields.velocity.coords.push_back(block.low + SurfaceBand::placeOf(i));
            fields.fragment.scalars.push_back(float(surface.fragment[n]));
        }
    fields.velocity.vectors.resize(closest.size());
    parallelChunks(closest.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            fields.velocity.vectors[i] =
                velocityAt(surface, closest[i], pointVelocity, voxelSize * fields.velocity.coords[i].toVec())
                    .cast<float>();
    });
    fields.fragment.coords = fields.velocity.coords;
    fields.surface = wrap(levelSetOf(band, voxelSize));
    return fields;
}

}  // namespace vdbfrac::grid
