// When voxel nodes failed.
#pragma once

#include <vdbfrac/tetmesh/node_field.h>

#include <map>

namespace vdbfrac::effects {

using Arrivals = std::map<Coord, float>;  ///< s

/// Of a lattice twice as fine, with phi [m] at rest and now: a node that has failed has the time of the nearest of the
/// wide ones that did; of several the earliest.
Arrivals arrivalsOnFiner(const Arrivals& wide, const tetmesh::NodeField<float>& rest,
                         const tetmesh::NodeField<float>& now);

}  // namespace vdbfrac::effects
