// Where pieces are drawn against each other. Contact gives way by a part of a voxel, and torn faces are drawn as closed
// lips, up to a voxel beyond the material that touches: pieces that lie on each other would be seen in each other.
#pragma once

#include <vdbfrac/core/stages.h>

#include <span>

namespace vdbfrac::effects {

/// Moves points of pieces that are in another piece to the surface of that, by half of the way where both have points
/// to move, as long as they are no deeper than two voxels dx [m]; deeper ones by less, and none that are three deep.
/// Lips that lie on each other stay. Pieces that are inside out push nothing, and thin ones not what is in their
/// middle: on the other side of that the way out is another. Velocities stay.
void drawApart(std::span<core::DrawnSurface> surfaces, double dx);

}  // namespace vdbfrac::effects
