// A ball as a level set: what stages and kernels are measured on where the lattice has to cut.
#pragma once

#include <vdbfrac/grid/body_level_set.h>

namespace vdbfrac::lab::bench {

inline constexpr double kBallRadius = 0.5;  // m

/// `dx` [m]: voxel size.
grid::LevelSet makeBall(double dx);

}  // namespace vdbfrac::lab::bench
