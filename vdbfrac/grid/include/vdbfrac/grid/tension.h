// Energy of the tension that opens a crack, by averages round voxel nodes p at the surface.
//
//   R(p) = sum_q u V_q <s1>^2 / (2 E) / sum_q u V_q,   u = (1 - r^2/(2l/3)^2)^2,   <a> = max(a, 0)
//   H(p) = sum_q w V_q C <s>^2 / sum_q w V_q,          w = (1 - r^2/l^2)^2
//   Psi(p) = max R,   share(p) = 1 - (1 - H(p) / max H) / .2   maxima near p; the front moves where both are large
//   q    voxel nodes within l of p, r and d distance and direction from p to q
//   V    material round q, S its mean stress, s1 the largest principal stress
//   s    largest stress across d: largest eigenvalue of S in the plane perpendicular to d; t: the other eigenvalue
//   there C    1 - nu t / (d S d + s), in [1 - nu^2, 1]: of plane strain and of plane stress
// How much: R goes with the energy release G of a tip near p, 2/3 R l / G = .287 in plane stress, and is the energy
// density in a smooth bar. Over less than l, as the wider it is, the earlier smooth faces tear beside a tip. Which way:
// H weighs each direction by the stress that opens it. Its first moment round a tip points 0 degrees ahead in mode I
// and 74 towards the tension in mode II; Erdogan & Sih 1963: 70.5.
//
// Where a toughness is given, Psi is instead
//   Psi(p) = max of A G / l, no less than 2/3 R and no more than 5/2 R      G as energy_release.h has it
// which also holds where l is not small against the specimen. R keeps what is squeezed from tearing, and tears smooth
// faces. Where R is largest and above 3/2 kappa the front moves whatever H says: across a ligament nothing pulls.
//
// Where material is weaker or stronger than the rest by f, Psi / f, R / f and H / f stand for Psi, R and H.
// H, and R where it is compared, are less by .3 d^2 at voxel nodes d <= 1 voxel off the way of a crack (crack_path.h).
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/grid/crack_path.h>
#include <vdbfrac/grid/energy_release.h>
#include <vdbfrac/grid/transfer.h>
#include <vdbfrac/tetmesh/body_mesh.h>

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace vdbfrac::grid {

/// Stress [Pa] of each tet with material of an element, in the frame of the rest configuration.
using ElementStress = std::function<std::array<Mat3, tetmesh::kMaxTets>(std::uint32_t element)>;

struct TensionAverage {
    double radius = 0;           ///< l [m]; 0: Psi is that of the mean stress at p
    double youngsModulus = 0;    ///< E [Pa]
    double poissonRatio = 0;     ///< nu
    VoxelFilter isCounted = {};  ///< other material is left out; none: all counts
    double perRelease = 0;       ///< A / l [1/m]: Psi of a G of 1; 0: Psi is R
    /// f at voxel nodes: kappa is f times what is given; all Psi and H are over it. None: 1.
    std::function<double(Coord)> factor = {};
    double leastFactor = 1;  ///< f is no less at any voxel node of the body, or in the gap beside it
};

/// A body under load.
struct Loaded {
    const tetmesh::BodyMesh& mesh;
    std::span<const double> energy;   ///< density [J/m^3] of the tets, by tetmesh::tetEntry
    ElementStress stress;             ///< from the same strains as `energy`
    VoxelFilter isFront;              ///< voxel nodes that may tear
    ElementForcesOf forces = {};      ///< where Psi is that of G
    const CrackPath* path = nullptr;  ///< that fronts go on with; null: each node is for itself
};

struct TensionAbove {
    std::vector<Coord> voxels;  ///< sorted
    std::vector<double> psi;    ///< J/m^3
    std::vector<double> share;  ///< of the speed that Psi gives the front, in (0, 1]
    std::vector<Vec3> points;   ///< of the crack's middle, where it passes them [voxels]
    std::int64_t stresses = 0;  ///< voxel nodes whose stress it took
    double largest = 0;         ///< Psi [J/m^3], also below kappa; 0 where it is far below, or without an average
    Coord where{};              ///< of the largest
};

/// Where at the front Psi exceeds kappa [J/m^3], and a share is left. Stresses are computed only where it can: first
/// where energies leave room for a Psi above kappa, then round what has one. `expected`: the largest Psi of the step
/// before, which makes finding it cheap.
TensionAbove tensionAbove(double kappa, const Loaded& body, const TensionAverage& average, double expected = 0);

/// Psi at the voxel nodes of the front, of each alone. Of no node where energies leave no room for more than `little`
/// [J/m^3].
VoxelValues tensionAtFront(const Loaded& body, const TensionAverage& average, double little = 0);

/// The least energy density [J/m^3] of any stress whose largest principal one alone has the energy `tension`.
double minEnergyUnder(double tension, double poissonRatio);

}  // namespace vdbfrac::grid
