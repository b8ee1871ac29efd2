// Where the surface of a solid is, to begin meshing from. Not installed.
#pragma once

#include <vdbfrac/mesher/delaunay.h>

#include <vector>

namespace vdbfrac::mesher {

/// A segment that crosses the surface.
struct SurfaceEdge {
    Vec3 inside, outside;
};

/// Samples phi on a lattice over the box and returns some of the lattice edges that cross the surface, `apart` [m] from
/// each other, nearer on small components: those of each component of the surface (of each pair of connected inside and
/// outside). Throws InputError where phi is not finite or the solid reaches a face of the box, or when there is none.
std::vector<SurfaceEdge> startEdges(const ImplicitSolid& solid, double spacing, double apart);

}  // namespace vdbfrac::mesher
