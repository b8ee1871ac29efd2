// What a scene that can run may still not mean.
#pragma once

#include <vdbfrac/scene/scene.h>

#include <string>
#include <vector>

namespace vdbfrac::scene {

/// Motions of grips and colliders that go on long after the last frame, as they do where keys were given in frames:
/// sentences.
std::vector<std::string> notesOf(const Scene& scene);

}  // namespace vdbfrac::scene
