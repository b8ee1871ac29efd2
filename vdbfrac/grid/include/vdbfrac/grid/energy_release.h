// Energy release rate of a crack, by the material forces of the nodes round its tip.
//
//   J(p) = -sum_a q(X_a - p) (f_a + A^T r_a),   G(p) = |J'| / (.95 L)
//   f, r   material and elastic forces of nodes (tetmesh/element_forces.h)
//   q      1 up to .4 of the radius, then (1 - s^2)^2 down to 0 at it
//   A      mean of F in the ball: where nodes are not in equilibrium, as in motion, J is that of the rest of F
//   L      integral of q along the front through p: along J x n, n the way of the largest stretch
//   J'     J without what is normal to the faces in which that front ends: only the front moves, not the face
// J is what the energy falls by as all that is in the middle of the ball, the tip of a crack with the way its cells are
// cut, moves by a unit length (Eshelby 1975; as a sum over a domain: Li, Shih, Needleman 1985; by nodes: Braun 1997).
// Round a tip in an unbounded body it does not depend on q. On lattices of six and five tets it is .95 of G: measured
// in clamped strips at all places of a tip between nodes, .93 to 1 (docs/physics.md).
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/grid/transfer.h>
#include <vdbfrac/tetmesh/body_mesh.h>
#include <vdbfrac/tetmesh/element_forces.h>

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace vdbfrac::grid {

using ElementForcesOf = std::function<tetmesh::ElementForces(std::uint32_t element)>;

/// Of a crack with its tip at a voxel node.
struct Release {
    double G = 0;               ///< J/m^2
    Vec3 along = Vec3::Zero();  ///< unit, of its front; 0 where there is none
};

/// At some voxel nodes in the material; at smooth faces what their material holds per area as if it were a tip. Where
/// forces pull opposite ways, in a ligament between two tips, as much as what pulls either way. `radius` [m]: of q.
/// `isCounted`: voxel nodes that no grip holds, others are left out.
std::vector<Release> energyRelease(const tetmesh::BodyMesh& mesh, const ElementForcesOf& forces,
                                   std::span<const Coord> tips, double radius, const VoxelFilter& isCounted);

}  // namespace vdbfrac::grid
