// What is said of a run before, during and after it.
#pragma once

#include <vdbfrac/core/estimate.h>
#include <vdbfrac/core/run_folder.h>
#include <vdbfrac/core/simulation.h>

#include <string>

namespace vdbfrac::cli {

/// The plan of a run: sizes, memory, the stages it will go through and why the others are off.
std::string planText(const scene::Scene& scene, const core::SceneEstimate& estimate,
                     const core::Simulation* simulation);
/// One line on a step.
std::string stepText(const core::StepRecord& step);
/// ", worst at [x, y, z] m at rest" of a step that a solve has failed in; empty of others.
std::string unsolvedPlace(const core::StepRecord& step);
/// What is wrong with a step that is capped.
std::string cappedText(const core::StepRecord& step);
bool anyCapped(const std::vector<core::StepRecord>& steps);
/// The closing summary, with a table of seconds and work counters by stage.
std::string summaryText(const core::Simulation& simulation, const core::RunFolder& folder, const Ledger& work);

}  // namespace vdbfrac::cli
