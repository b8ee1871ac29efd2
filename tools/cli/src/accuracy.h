// Accuracy levels of `vdbfrac sim`: the knobs that cost most, set together, with what a study of them found.
#pragma once

#include <vdbfrac/scene/scene.h>

#include <string>
#include <vector>

namespace vdbfrac::cli {

/// "draft", "normal" (the scene as it is), "fine".
std::vector<std::string> accuracyLevels();

/// Sets voxel size, time step and Newton tolerance of a scene, relative to what it says.
void setAccuracy(scene::Scene& scene, const std::string& level);

/// What was set, and what error and time to expect of it: one line.
std::string accuracyText(const scene::Scene& scene, const std::string& level);

}  // namespace vdbfrac::cli
