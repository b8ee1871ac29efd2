// Energy of the tension that opens a crack, by averages round voxel nodes p at the surface.
//
//   R(p) = sum_q w V_q <s1>^2 / (2 E) / sum_q w V_q,   w = (1 - r^2/l^2)^2,   <a> = max(a, 0)
//   H(p) = sum_q w V_q C <s>^2 / sum_q w V_q
//   Psi(p) = H(p) max R / max H                        maxima near p
//   q    voxel nodes within l of p, r and d distance and direction from p to q
//   V    material round q, S its mean stress, s1 the largest principal stress
//   s    largest stress across d: largest eigenvalue of S in the plane perpendicular to d; t: the other eigenvalue
//   there C    1 - nu t / (d S d + s), in [1 - nu^2, 1]: of plane strain and of plane stress
// How much: R goes with the energy release G of a tip near p, R l / G = .287 in plane stress, and is the energy density
// in a smooth bar. Which way: H weighs each direction by the stress that opens it. Its first moment round a tip points
// 0 degrees ahead in mode I and 74 towards the tension in mode II; Erdogan & Sih 1963: 70.5.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/grid/transfer.h>
#include <vdbfrac/tetmesh/body_mesh.h>

#include <array>
#include <functional>
#include <span>
#include <vector>

namespace vdbfrac::grid {

/// Stress [Pa] of each tet with material of an element, in the frame of the rest configuration.
using ElementStress = std::function<std::array<Mat3, tetmesh::kMaxTets>(std::uint32_t element)>;

struct TensionAverage {
    double radius = 0;         ///< l [m]; 0: Psi is that of the mean stress at p
    double youngsModulus = 0;  ///< E [Pa]
    double poissonRatio = 0;   ///< nu
};

/// Psi [J/m^3] at voxel nodes with material, each once.
std::vector<double> averagedTension(const tetmesh::BodyMesh& mesh, const ElementStress& stress,
                                    std::span<const Coord> voxels, const TensionAverage& average);

/// Those of `front`, sorted voxel nodes, whose Psi may exceed `kappa` [J/m^3], and those that it depends on. It takes
/// an average over a radius, and only energies of tets, which cost far less than their stresses.
std::vector<Coord> whereTensionMayExceed(double kappa, const tetmesh::BodyMesh& mesh, const TetEnergy& energy,
                                         std::span<const Coord> front, const TensionAverage& average);

/// The least energy density [J/m^3] of any stress whose largest principal one alone has the energy `tension`.
double minEnergyUnder(double tension, double poissonRatio);
/// Voxels from a node to those whose material its Psi depends on.
int tensionReach(double radius, double voxelSize);

}  // namespace vdbfrac::grid
