// Steps and frames of a run, as its manifest and its checkpoints keep them. Not installed.
#pragma once

#include <vdbfrac/core/archive.h>
#include <vdbfrac/core/run_folder.h>

#include <nlohmann/json.hpp>

#include <vector>

namespace vdbfrac::core {

nlohmann::json framesJson(const std::vector<FrameRecord>& frames);

void saveRecords(const std::vector<StepRecord>& steps, const std::vector<FrameRecord>& frames, Archive& archive);
/// Throw FileError for what saveRecords cannot have written.
std::vector<StepRecord> loadSteps(const Archive& archive);
std::vector<FrameRecord> loadFrames(const Archive& archive);

}  // namespace vdbfrac::core
