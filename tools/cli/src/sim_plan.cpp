#include "sim_plan.h"

#include "accuracy.h"
#include "expected_errors.h"
#include "forecast_text.h"
#include "run_report.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/lab/scenes/prepared_scene.h>

#include <cstdio>
#include <optional>

namespace vdbfrac::cli {

bool isQuicklyMade(const scene::Scene& scene, const core::SceneEstimate& estimate)
{
    constexpr double kQuick = 1e6;  // tets
    return estimate.tets <= kQuick && scene.grid.lattice != scene::LatticeKind::delaunay;
}

void printPlan(const scene::Scene& scene, const core::SceneEstimate& estimate, const std::string& accuracy,
               const lab::ForecastSettings& how)
{
    if (!accuracy.empty()) std::printf("%s\n", accuracyText(scene, accuracy).c_str());
    std::optional<lab::PreparedScene> prepared;
    const bool fits = estimate.bytes <= double(how.memoryLimit);
    if (fits && isQuicklyMade(scene, estimate))
        prepared.emplace(scene, how.memoryLimit);
    else if (fits)
        lab::requireSound(scene);
    std::fputs(planText(scene, estimate, prepared ? &prepared->simulation : nullptr).c_str(), stdout);
    std::fputs(expectedErrors(scene, estimate).c_str(), stdout);
    std::fputs(filesText(scene).c_str(), stdout);
    core::requireMemory(estimate, how.memoryLimit);
    if (how.seconds == 0) return;
    std::fflush(stdout);  // the rest takes a while
    prepared.reset();
    try {
        std::fputs(forecastText(scene, lab::forecast(scene, estimate, how)).c_str(), stdout);
    } catch (const Error& e) {
        std::printf("time: not known: %s\n", e.what());
    }
}

}  // namespace vdbfrac::cli
