// Where a crack that takes a voxel node passes it (crack_path.h). Not installed.
#pragma once

#include "front_values.h"

#include <vdbfrac/grid/crack_path.h>

namespace vdbfrac::grid {

struct Passing {
    Vec3 point;         // of the crack's middle [voxels]
    double weight = 1;  // of what drives the node against others: the farther off its way, the less
};

/// `normal`: across the crack, unit. `near`: nodes whose points say where it lies. `R`: what drives the nodes of the
/// front.
Passing passingAt(Coord voxel, const Vec3& normal, const CrackPath& path, const Sparse& R,
                  const std::vector<Neighbour>& near);

}  // namespace vdbfrac::grid
