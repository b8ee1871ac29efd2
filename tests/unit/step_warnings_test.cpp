// What a run tells while it goes on: once, and only where it is so.
#include "step_warnings.h"

#include <gtest/gtest.h>

#include <spdlog/sinks/ostream_sink.h>

#include <memory>
#include <sstream>
#include <string>

using namespace vdbfrac;
using cli::StepWarnings;

namespace {

constexpr double kNoise = 1e-6;  // J
constexpr StepWarnings::Start kStart{2, kNoise};

/// Of a step in which nothing is lost.
core::StepRecord whole()
{
    core::StepRecord step;
    step.volume = kStart.volume;
    return step;
}

class StepWarningsTest : public testing::Test {
protected:
    std::string told(const scene::Scene& scene, const core::StepRecord& step, int steps)
    {
        std::ostringstream text;
        spdlog::logger log("test", std::make_shared<spdlog::sinks::ostream_sink_mt>(text));
        StepWarnings warnings(scene, kStart, log);
        for (int i = 0; i < steps; ++i) warnings.see(step);
        return text.str();
    }
    static std::size_t count(const std::string& text, const std::string& word)
    {
        std::size_t n = 0;
        for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++n;
        return n;
    }
};

TEST_F(StepWarningsTest, TellOnceOfEnergyThatTheIntegratorHasMade)
{
    core::StepRecord step = whole();
    scene::Scene scene;
    scene.solver.integrator = scene::Integrator::midpoint;
    step.kineticEnergy = 100;
    step.energyFlow["integrator"] = -2;  // J: three steps make 6 % of what there is
    EXPECT_EQ(told(scene, step, 2), "");
    EXPECT_EQ(count(told(scene, step, 20), "the integrator has made 6 % of the most energy"), 1u);
    EXPECT_EQ(told({}, step, 20), "") << "by backward Euler";
    step.energyFlow["integrator"] = 2;
    EXPECT_EQ(told(scene, step, 20), "");
    step.kineticEnergy = 1e-3 * kNoise, step.energyFlow["integrator"] = -1e-3 * kNoise;
    EXPECT_EQ(told(scene, step, 20), "") << "of rounding";
}

TEST_F(StepWarningsTest, TellOnceOfShortStepsWhereThingsTouch)
{
    core::StepRecord touching = whole(), apart = whole();
    touching.outcome = apart.outcome = core::Outcome::cutback;
    touching.cutbacks = apart.cutbacks = 1;
    touching.work.count("collider", "active", 3);
    EXPECT_EQ(told({}, touching, 8), "");
    EXPECT_EQ(count(told({}, touching, 200), "9 of the last 30 steps were cut back"), 1u);
    EXPECT_EQ(told({}, apart, 200), "");
    touching.cutbacks = 0;
    EXPECT_EQ(told({}, touching, 200), "");
}

TEST_F(StepWarningsTest, TellOnceWhereATenthIsLost)
{
    core::StepRecord step = whole();
    step.volume = .91 * kStart.volume;
    EXPECT_EQ(told({}, step, 5), "");
    step.volume = .88 * kStart.volume;
    EXPECT_EQ(count(told({}, step, 5), "cracks have taken 12 % of the material so far"), 1u);
}

TEST_F(StepWarningsTest, ToldBeforeAStopAreNotToldAgain)
{
    core::StepRecord step = whole();
    step.kineticEnergy = 100;
    step.energyFlow["integrator"] = -10;
    std::ostringstream text;
    spdlog::logger log("test", std::make_shared<spdlog::sinks::ostream_sink_mt>(text));
    scene::Scene scene;
    scene.solver.integrator = scene::Integrator::midpoint;
    StepWarnings warnings(scene, kStart, log);
    warnings.takeUp({step});
    warnings.see(step);
    EXPECT_EQ(text.str(), "");
}

}  // namespace
