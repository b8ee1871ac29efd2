// What a user should know of a run while it runs, each once.
#pragma once

#include "run_report.h"

#include <spdlog/spdlog.h>

#include <cstdint>
#include <deque>
#include <vector>

namespace vdbfrac::cli {

class StepWarnings {
public:
    /// `noise` [J]: as MadeEnergy takes it.
    StepWarnings(const scene::Scene& scene, double noise, spdlog::logger& log);
    /// Steps that an earlier run has told of.
    void takeUp(const std::vector<core::StepRecord>& steps);
    /// After each step.
    void see(const core::StepRecord& step);

private:
    void ofUnnamed(const core::StepRecord& step);
    void ofMade(const core::StepRecord& step);
    void ofCreases(const core::StepRecord& step);
    void ofShortSteps(const core::StepRecord& step);

    spdlog::logger& log_;
    bool hasVolume_;
    bool toldOfUnnamed_ = false, toldOfMade_ = false, toldOfCreases_ = false, toldOfShortSteps_ = false;
    MadeEnergy made_;
    std::int64_t creases_ = 0;
    std::deque<bool> wasCutBack_;  // of the last steps, where something touched
};

}  // namespace vdbfrac::cli
