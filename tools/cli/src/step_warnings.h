// What a user should know of a run while it runs, each once.
#pragma once

#include "run_report.h"

#include <spdlog/spdlog.h>

#include <cstdint>
#include <deque>
#include <vector>

namespace vdbfrac::cli {

/// Advice to whoever loses much of it.
inline constexpr const char* kWhatKeepsMaterial =
    "a higher toughness, or factor of fracture.keys, keeps more, a smaller grid.voxel_size where few cracks run, and a "
    "notch or fracture.scatter where a smooth surface tears all at once";

class StepWarnings {
public:
    /// Of the bodies at rest: `volume` [m^3], and `noise` [J] as MadeEnergy takes it.
    struct Start {
        double volume = 0, noise = 0;
    };
    StepWarnings(const scene::Scene& scene, const Start& start, spdlog::logger& log);
    /// Steps that an earlier run has told of.
    void takeUp(const std::vector<core::StepRecord>& steps);
    /// After each step.
    void see(const core::StepRecord& step);

private:
    void ofUnnamed(const core::StepRecord& step);
    void ofMade(const core::StepRecord& step);
    void ofCreases(const core::StepRecord& step);
    void ofShortSteps(const core::StepRecord& step);
    void ofLoss(const core::StepRecord& step);
    bool isMuchLost(const core::StepRecord& step) const;

    spdlog::logger& log_;
    double startVolume_;  // m^3
    bool hasVolume_;
    bool toldOfUnnamed_ = false, toldOfMade_ = false, toldOfCreases_ = false, toldOfShortSteps_ = false,
         toldOfLoss_ = false;
    MadeEnergy made_;
    std::int64_t creases_ = 0;
    std::deque<bool> wasCutBack_;  // of the last steps, where something touched
};

}  // namespace vdbfrac::cli
