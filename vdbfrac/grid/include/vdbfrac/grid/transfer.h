// Energy density of the tets -> nodal energy on voxels.
//
//   Psi(X_p) = sum_k Psi(T_k) int_{T_k} N_p dX / sum_k int_{T_k} N_p dX
// over the material part of each sub-tet T_k round voxel node p only: what has failed does not dilute it.
// Hegemann et al. 2013, section 5 (there over whole tets).
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/grid/voxel_values.h>
#include <vdbfrac/tetmesh/body_mesh.h>

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace vdbfrac::grid {

using tetmesh::TetEnergy;
/// Whether the material round a voxel node counts in averages.
using VoxelFilter = std::function<bool(Coord)>;

/// Farthest voxel, along an axis, that is inside a ball of this radius [voxels]: at the radius itself weights are 0.
int reachWithin(double radius);

/// The elements that hold material round voxel nodes, rising.
std::vector<std::uint32_t> elementsRound(const tetmesh::BodyMesh& mesh, std::span<const Coord> voxels);

/// Nodal energy [J/m^3] at voxel nodes; 0 where no material is.
std::vector<double> nodalEnergy(const tetmesh::BodyMesh& mesh, const TetEnergy& energy, std::span<const Coord> voxels);

/// Nodal energy [J/m^3] of all voxel nodes with material; in a fixed order.
VoxelValues nodalEnergies(const tetmesh::BodyMesh& mesh, const TetEnergy& energy);

/// Nodal energy averaged over the material within `radius` [m] with weights (1 - r^2/radius^2)^2; 0 where none counts.
std::vector<double> averagedEnergy(const tetmesh::BodyMesh& mesh, const TetEnergy& energy,
                                   std::span<const Coord> voxels, double radius, const VoxelFilter& isCounted = {});

/// Material volume that belongs to a voxel node: sum of the integrals of N_p, in voxels.
double nodalVolume(const tetmesh::BodyMesh& mesh, Coord voxel);

}  // namespace vdbfrac::grid
