// From scene and command line to a study's settings and runs.
#pragma once

#include <vdbfrac/lab/study/study.h>

#include <filesystem>
#include <string>
#include <vector>

namespace vdbfrac::lab::study {

/// What a study is made of.
struct PlanInput {
    std::filesystem::path scene;
    std::vector<std::string> set;      ///< --set
    std::vector<std::string> vary;     ///< --vary: "key=value,value"; each makes a series, in place of the scene's own
    bool grid = false;                 ///< combines them: a series of the first for each combination of the others
    std::vector<std::string> measure;  ///< --measure: "quantity" or "quantity:key=value,..."
    std::string program;               ///< fingerprint of the program: what another one left is not reused
};

/// Reads the scene and every setting of it. A setting that is no valid scene becomes a run with a failure.
/// Throws InputError for a scene without [study] where nothing is varied, and for what is wrong with the study itself.
Study makePlan(const PlanInput& input);

}  // namespace vdbfrac::lab::study
