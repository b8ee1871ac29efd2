// When a run is given up.
#pragma once

#include <vdbfrac/core/simulation.h>

namespace vdbfrac::lab {

/// Counts the steps of a frame.
class Patience {
public:
    /// Where a third of so many steps of a frame were cut back or not solved, the next ones will be: the frame gets
    /// nowhere.
    bool isOver(const core::StepRecord& step, int framesDone)
    {
        constexpr int kSteps = 300;
        if (framesDone != framesDone_) framesDone_ = framesDone, steps_ = troubled_ = 0;
        ++steps_, troubled_ += step.outcome != core::Outcome::converged;
        return steps_ >= kSteps && 3 * troubled_ > steps_;
    }

private:
    int framesDone_ = -1, steps_ = 0, troubled_ = 0;
};

}  // namespace vdbfrac::lab
