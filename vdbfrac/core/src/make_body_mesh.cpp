#include "make_body_mesh.h"

#include <vdbfrac/grid/phi_nodes.h>
#include <vdbfrac/grid/phi_sampler.h>
#include <vdbfrac/mesher/delaunay.h>
#include <vdbfrac/tetmesh/cut_mesh.h>
#include <vdbfrac/tetmesh/cut_tet_mesh.h>

#include <algorithm>

namespace vdbfrac::core {

namespace {

/// Tets of edges near h round the material and half a voxel beyond it, so that phi > 0 at the boundary of the mesh;
/// larger ones, where the scene allows it, where phi says no more than that the surface is far.
tetmesh::TetMesh enclosingTets(const scene::Grid& grid, const grid::LevelSet& phi, std::uint64_t memoryLimit)
{
    constexpr double kMargin = 0.5;         // voxels
    constexpr double kBytesAPoint = 12000;  // of mesher, mesh and solver
    const double dx = phi.voxelSize(), size = mesher::kRadiusOfEdge * grid.coarsening * dx,
                 deep = -0.9 * phi.background();
    const auto sample = grid::phiSampler(phi);
    mesher::DelaunayCriteria criteria;
    criteria.facetSize = size;
    criteria.cellSize = size * grid.grading;
    criteria.maxPoints = std::max<std::size_t>(1, std::size_t(double(memoryLimit) / kBytesAPoint));
    if (grid.grading > 1)
        criteria.sizing = [=](const Vec3& X) { return sample(X) > deep ? size : size * grid.grading; };
    return mesher::delaunayMesh({[=](const Vec3& X) { return sample(X) - kMargin * dx; }, grid::materialBox(phi), {}},
                                criteria);
}

}  // namespace

std::unique_ptr<tetmesh::BodyMesh> makeBodyMesh(const scene::Grid& grid, const grid::LevelSet& phi,
                                                const tetmesh::RestShape& shape, std::uint64_t memoryLimit)
{
    using Kind = tetmesh::Lattice::Kind;
    if (grid.lattice == scene::LatticeKind::delaunay)
        return std::make_unique<tetmesh::CutTetMesh>(enclosingTets(grid, phi, memoryLimit),
                                                     grid.coarsening * grid.voxelSize, grid.voxelSize,
                                                     grid::sampleNodes(phi, memoryLimit), shape);
    const Kind kind = grid.lattice == scene::LatticeKind::six ? Kind::six : Kind::five;
    return std::make_unique<tetmesh::CutMesh>(tetmesh::Lattice{kind, grid.coarsening, grid.voxelSize, grid.wholeTets},
                                              grid::sampleNodes(phi, memoryLimit), shape);
}

}  // namespace vdbfrac::core
