#include "step_warnings.h"

#include <algorithm>

namespace vdbfrac::cli {

StepWarnings::StepWarnings(const scene::Scene& scene, const Start& start, spdlog::logger& log)
    : log_(log),
      startVolume_(start.volume),
      hasVolume_(scene.table("volume") != nullptr),
      made_(scene.solver.integrator, start.noise)
{
}

void StepWarnings::takeUp(const std::vector<core::StepRecord>& steps)
{
    for (const core::StepRecord& step : steps) made_.add(step);
    toldOfMade_ = made_.isMuch();
    toldOfLoss_ = !steps.empty() && isMuchLost(steps.back());
}

void StepWarnings::see(const core::StepRecord& step)
{
    if (step.outcome == core::Outcome::capped) log_.warn("{}", cappedText(step));
    ofUnnamed(step), ofMade(step), ofCreases(step), ofShortSteps(step), ofLoss(step);
}

/// It stays in the columns, and in the summary.
void StepWarnings::ofUnnamed(const core::StepRecord& step)
{
    if (toldOfUnnamed_ || step.unnamedShare <= core::kMaxUnnamedShare) return;
    toldOfUnnamed_ = true;
    log_.warn(
        "step {}: {:.2g} % of the work put in so far has no account (unnamed_J in stats.csv); what may help: shorter "
        "steps, a smaller solver.newton_tolerance",
        step.step, 100 * step.unnamedShare);
}

void StepWarnings::ofMade(const core::StepRecord& step)
{
    made_.add(step);
    if (toldOfMade_ || !made_.isMuch()) return;
    toldOfMade_ = true;
    log_.warn(
        "step {}: the integrator has made {:.2g} % of the most energy that there was (integrator_J in stats.csv): "
        "steps "
        "turn or squeeze stiff material too far; take more time.substeps, or solver.integrator = \"backward_euler\"",
        step.step, 100 * made_.share());
}

bool StepWarnings::isMuchLost(const core::StepRecord& step) const
{
    constexpr double kMuch = .1;
    return step.volume < (1 - kMuch) * startVolume_;
}

/// While there is time to stop it.
void StepWarnings::ofLoss(const core::StepRecord& step)
{
    if (toldOfLoss_ || !isMuchLost(step)) return;
    toldOfLoss_ = true;
    log_.warn("step {}, {:.4g} s: cracks have taken {:.2g} % of the material so far; {}", step.step, step.time,
              100 * (1 - step.volume / startVolume_), kWhatKeepsMaterial);
}

/// Where nothing keeps material from folding.
void StepWarnings::ofCreases(const core::StepRecord& step)
{
    constexpr std::int64_t kMany = 20;
    creases_ += step.work.countOf("solve", "creases");
    if (toldOfCreases_ || creases_ < kMany || hasVolume_) return;
    toldOfCreases_ = true;
    log_.warn("step {}: what is squeezed, bent or twisted here folds into creases, and steps get short; try [volume]",
              step.step);
}

/// Touches that are harder than what is touched can carry are most of the work of a shot, and nothing else shows it.
void StepWarnings::ofShortSteps(const core::StepRecord& step)
{
    constexpr std::size_t kLately = 30;
    constexpr double kMany = .3;
    const bool touches = step.work.countOf("contact", "active") + step.work.countOf("collider", "active") > 0;
    wasCutBack_.push_back(step.cutbacks > 0 && touches);
    if (wasCutBack_.size() > kLately) wasCutBack_.pop_front();
    const auto count = std::ranges::count(wasCutBack_, true);
    if (toldOfShortSteps_ || toldOfCreases_ || double(count) < kMany * kLately) return;
    toldOfShortSteps_ = true;
    log_.warn(
        "step {}: {} of the last {} steps were cut back while things touch{}; slower motion, less stiffness of "
        "[[collider]] and [contact] (which lets things sink deeper into each other){} take fewer",
        step.step, count, kLately, unsolvedPlace(step), hasVolume_ ? "" : ", or [volume]");
}

}  // namespace vdbfrac::cli
