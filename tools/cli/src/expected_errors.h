// What a scene's results may be off by, from what was measured on specimens with references.
#pragma once

#include <vdbfrac/core/estimate.h>
#include <vdbfrac/scene/scene.h>

#include <string>

namespace vdbfrac::cli {

/// A line for each body: how many lattice cells it is across at its narrowest, and how far off specimens of no more
/// cells were in stiffness, and in the load and the way of cracks where the scene names a toughness.
std::string expectedErrors(const scene::Scene& scene, const core::SceneEstimate& estimate);

}  // namespace vdbfrac::cli
