// The volume of a mesh from its elements. Not installed.
#pragma once

#include <vdbfrac/tetmesh/body_mesh.h>

namespace vdbfrac::tetmesh {

/// Material volume of all elements [m^3], in a fixed order.
double sumOfVolumes(const BodyMesh& mesh);

}  // namespace vdbfrac::tetmesh
