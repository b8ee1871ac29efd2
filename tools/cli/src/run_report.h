// What is said of a run before, during and after it.
#pragma once

#include <vdbfrac/core/estimate.h>
#include <vdbfrac/core/run_folder.h>
#include <vdbfrac/core/simulation.h>

#include <algorithm>
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
/// Energy that the integrator itself has made, step by step: schemes that do not damp make some where a step turns or
/// squeezes stiff material far. Backward Euler takes energy; what it seems to have made is that of colliders and grips
/// that set off.
class MadeEnergy {
public:
    /// `noise` [J]: less than this is no energy.
    MadeEnergy(scene::Integrator integrator, double noise)
        : makes_(integrator != scene::Integrator::backwardEuler), most_(noise)
    {
    }
    void add(const core::StepRecord& step);
    double share() const { return std::max(0., made_) / most_; }  ///< of the most that there was
    bool isMuch() const;

private:
    bool makes_;
    double made_ = 0, most_;  // J; less what it has taken
};
bool anyCapped(const std::vector<core::StepRecord>& steps);
/// The closing summary, with a table of seconds and work counters by stage.
std::string summaryText(const scene::Scene& scene, const core::Simulation& simulation, const core::RunFolder& folder,
                        const Ledger& work);

}  // namespace vdbfrac::cli
