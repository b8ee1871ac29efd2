// What 'vdbfrac sim -n' says.
#pragma once

#include <vdbfrac/core/estimate.h>
#include <vdbfrac/lab/forecast/forecast.h>
#include <vdbfrac/scene/scene.h>

#include <string>

namespace vdbfrac::cli {

/// Are bodies made in a few seconds?
bool isQuicklyMade(const scene::Scene& scene, const core::SceneEstimate& estimate);

/// Prints what would run; then its time and disk, measured as `how` says, not at all for 0 s. `accuracy`: the level
/// that the scene was brought to, or empty. Throws InputError, FileError; LimitError where the run would need more
/// memory than there may be.
void printPlan(const scene::Scene& scene, const core::SceneEstimate& estimate, const std::string& accuracy,
               const lab::ForecastSettings& how);

}  // namespace vdbfrac::cli
