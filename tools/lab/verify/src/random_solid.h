// Solids by the dice.
#pragma once

#include "dice.h"

#include <string>

namespace vdbfrac::lab::verify {

/// Where a solid is, and its lengths [m].
struct SolidFrame {
    Vec3 center = Vec3::Zero();
    int axis = 1;  ///< along which it is `length` long
    double length = 1;
    double cell = 1;  ///< of the lattice
};

/// The value of `shape` in a scene. At least two cells thick everywhere.
std::string randomSolid(Dice& dice, const SolidFrame& frame);

/// An element of `cut`: in the middle of a solid, for what grips hold stays.
std::string randomCut(Dice& dice, const SolidFrame& frame);

}  // namespace vdbfrac::lab::verify
