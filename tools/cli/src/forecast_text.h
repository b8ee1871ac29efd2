// What is said of the time and the files that a run will take.
#pragma once

#include <vdbfrac/core/simulation.h>
#include <vdbfrac/lab/forecast/forecast.h>

#include <string>

namespace vdbfrac::cli {

/// "4 min 20 s".
std::string durationText(double seconds);
/// Time, steps and disk, and what that is known from.
std::string forecastText(const scene::Scene& scene, const lab::Forecast& forecast);
/// Which files there will be, and what is in them.
std::string filesText(const scene::Scene& scene);

}  // namespace vdbfrac::cli
