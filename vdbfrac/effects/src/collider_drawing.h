// Where surfaces are drawn against colliders. Contact gives way by a part of a voxel, and closed lips, and skin that
// rides on strained tets, are drawn outside of the material that touches: all of that would be seen inside of
// colliders.
#pragma once

#include "collider_obstacles.h"

#include <vdbfrac/core/stages.h>

namespace vdbfrac::effects {

/// Moves points of a surface that are inside of colliders at a time [s] to the surface of these, where they are no
/// deeper than two voxels dx [m], or a quarter of what is nowhere thicker than eight; deeper ones by less, and none
/// that are twice as deep. What is moved goes with the collider across its surface, also by its velocity.
void moveOut(const Obstacles& obstacles, double time, double dx, core::DrawnSurface& surface);

}  // namespace vdbfrac::effects
