// Energy density of the tets -> nodal energy on voxels.
//
//   Psi(X_p) = sum_k Psi(T_k) int_{T_k} N_p dX / sum_k int_{T_k} N_p dX
// over the material part of each sub-tet T_k round voxel node p only: what has failed does not dilute it.
// Hegemann et al. 2013, section 5 (there over whole tets).
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/cut_mesh.h>

#include <functional>
#include <span>
#include <vector>

namespace vdbfrac::grid {

/// Energy density [J/m^3] of tet t of an element of the mesh.
using TetEnergy = std::function<double(std::uint32_t element, int tet)>;

/// Voxel nodes of all sub-tets whose energy density exceeds `threshold`, sorted, each once. No other voxel node can have
/// a nodal energy above it. `density`: entry 6 e + t for tet t of element e.
std::vector<Coord> voxelsAbove(const tetmesh::CutMesh& mesh, std::span<const double> density, double threshold);

/// All voxels no farther than `reach` along any axis from one of `voxels`; sorted, each once.
std::vector<Coord> voxelsAround(std::span<const Coord> voxels, int reach);

/// Nodal energy [J/m^3] at voxel nodes; 0 where no material is.
std::vector<double> nodalEnergy(const tetmesh::CutMesh& mesh, const TetEnergy& energy, std::span<const Coord> voxels);

/// Nodal energy averaged over the material within `radius` [m] with weights (1 - r^2/radius^2)^2.
std::vector<double> averagedEnergy(const tetmesh::CutMesh& mesh, const TetEnergy& energy, std::span<const Coord> voxels,
                                   double radius);

/// Material volume that belongs to a voxel node: sum of the integrals of N_p, in voxels.
double nodalVolume(const tetmesh::CutMesh& mesh, Coord voxel);

}  // namespace vdbfrac::grid
