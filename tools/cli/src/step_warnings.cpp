#include "step_warnings.h"

#include <algorithm>
#include <utility>

namespace vdbfrac::cli {

namespace {

bool hasTable(const scene::Scene& scene, const std::string& name)
{
    return std::ranges::any_of(scene.tables, [&](const scene::NamedValues& table) { return table.name == name; });
}

}  // namespace

StepWarnings::StepWarnings(const scene::Scene& scene, spdlog::logger& log)
    : log_(log), hasVolume_(hasTable(scene, "volume")), touches_(hasTable(scene, "contact") || !scene.colliders.empty())
{
}

void StepWarnings::see(const core::StepRecord& step)
{
    if (step.outcome == core::Outcome::capped) log_.warn("{}", cappedText(step));
    ofUnnamed(step), ofMade(step), ofCreases(step), ofShortSteps(step);
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
        "step {}: the integrator has made {:.2g} % of the energy that there is (integrator_J in stats.csv): steps turn "
        "or squeeze stiff material too far; more time.substeps, or solver.integrator = \"backward_euler\"",
        step.step, 100 * made_.share());
}

/// Where nothing keeps material from folding.
void StepWarnings::ofCreases(const core::StepRecord& step)
{
    constexpr std::int64_t kMany = 20;
    const std::int64_t before = std::exchange(creases_, creases_ + step.work.countOf("solve", "creases"));
    if (before >= kMany || creases_ < kMany || hasVolume_) return;
    log_.warn("step {}: what is squeezed, bent or twisted here folds into creases, and steps get short; try [volume]",
              step.step);
}

/// Touches that are harder than what is touched can carry are most of the work of a shot, and nothing else shows it.
void StepWarnings::ofShortSteps(const core::StepRecord& step)
{
    constexpr std::size_t kLately = 30;
    constexpr double kMany = .3;
    if (toldOfShortSteps_ || !touches_) return;
    wasCutBack_.push_back(step.cutbacks > 0);
    if (wasCutBack_.size() <= kLately) return;
    wasCutBack_.pop_front();
    const auto count = std::ranges::count(wasCutBack_, true);
    if (double(count) < kMany * kLately) return;
    toldOfShortSteps_ = true;
    log_.warn(
        "step {}: {} of the last {} steps were cut back, where things touch{}; slower motion there, or less stiffness "
        "of "
        "[[collider]] or [contact], takes fewer",
        step.step, count, kLately, unsolvedPlace(step));
}

}  // namespace vdbfrac::cli
