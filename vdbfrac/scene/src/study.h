// The table [study].
#pragma once

#include "check.h"

#include <vdbfrac/scene/scene.h>

namespace vdbfrac::scene {

/// Reads it for a scene whose bodies and grips are there already.
Study readStudy(const Item& item, const Scene& scene, Complaints& complaints);

}  // namespace vdbfrac::scene
