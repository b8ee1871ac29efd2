// When voxel nodes failed, and where the crack passed them.
#pragma once

#include <vdbfrac/core/archive.h>
#include <vdbfrac/core/body.h>
#include <vdbfrac/grid/crack_path.h>
#include <vdbfrac/grid/voxel_values.h>

#include <map>
#include <string>

namespace vdbfrac::effects {

struct Arrival {
    float time = 0;  ///< s
    Vec3 point;      ///< of the crack's middle [voxels]
};
using Arrivals = std::map<Coord, Arrival>;

/// Times; -1 elsewhere.
grid::VoxelValues timesOf(const Arrivals& arrivals);

/// Of a body with this phi.
grid::CrackPath pathOf(const Arrivals& arrivals, const tetmesh::NodeField<float>& phi);

void save(const Arrivals& arrivals, const std::string& name, core::Archive& archive);
/// Throws where the archive complains.
Arrivals restoredArrivals(const std::string& name, const core::Body& body, const core::Archive& archive);

/// Of a lattice twice as fine, with phi [m] at rest and now: a node that has failed has the time of the nearest of the
/// wide ones that did, of several the earliest, and the point of the crack there.
Arrivals arrivalsOnFiner(const Arrivals& wide, const tetmesh::NodeField<float>& rest,
                         const tetmesh::NodeField<float>& now);

}  // namespace vdbfrac::effects
