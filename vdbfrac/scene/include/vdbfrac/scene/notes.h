// What a scene that can run may still not mean.
#pragma once

#include <vdbfrac/scene/scene.h>

#include <string>
#include <vector>

namespace vdbfrac::scene {

/// Sentences. Times long after the last frame, as they are where they were given in frames; settings that do nothing.
std::vector<std::string> notesOf(const Scene& scene);

}  // namespace vdbfrac::scene
