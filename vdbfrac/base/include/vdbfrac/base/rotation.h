// Rotations as scenes tell them.
#pragma once

#include <vdbfrac/base/vec.h>

namespace vdbfrac {

/// The rotation that is told by angles [degrees] about x, then y, then z.
Mat3 rotationOf(const Vec3& angles);

}  // namespace vdbfrac
