// What a run will take, told from a few of its steps and from all of it on wider voxels, against runs. Seconds are left
// out: they are the machine's.
#include <vdbfrac/core/estimate.h>
#include <vdbfrac/core/run_folder.h>
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/lab/forecast/forecast.h>
#include <vdbfrac/lab/scenes/scene_run.h>
#include <vdbfrac/scene/reader.h>

#include <gtest/gtest.h>

#include <filesystem>

#include <unistd.h>

using namespace vdbfrac;
namespace fs = std::filesystem;

namespace {

constexpr double kNoHaste = 1e6;  // s: no sample ends early, whatever else the machine does

scene::Scene shipped(const std::string& name, const std::vector<std::string>& set)
{
    return scene::readScene(fs::path(VDBFRAC_SOURCE) / "data/scenes" / (name + ".toml"), effects::vocabulary(), set);
}

lab::Forecast foretold(const scene::Scene& scene, lab::ForecastSettings settings)
{
    constexpr std::uint64_t kAny = ~std::uint64_t{0};
    settings.memoryLimit = kAny;
    return lab::forecast(scene, core::estimateScene(scene, kAny, effects::bytesPerTet(scene)), settings);
}

struct Taken {
    double steps = 0, bytes = 0;
};
/// Runs a scene into a folder, with a checkpoint at each frame, as 'vdbfrac sim' does.
Taken run(const scene::Scene& scene)
{
    const fs::path folder = fs::temp_directory_path() / ("vdbfrac-forecast-" + std::to_string(::getpid()));
    fs::remove_all(folder);
    Taken result;
    {
        lab::PreparedScene prepared(scene, ~std::uint64_t{0});
        core::RunFolder out(folder, scene, prepared.simulation, core::ExistingRun::refuse);
        for (int frame = scene.time.firstFrame; frame <= scene.time.lastFrame; ++frame) {
            while (prepared.simulation.framesDone() < frame - scene.time.firstFrame)
                out.addStep(prepared.simulation.stepInFrame());
            out.writeFrame(prepared.simulation, frame);
            out.writeCheckpoint(prepared.simulation, "settings");
        }
        out.finish(prepared.simulation, "done");
        result.steps = prepared.simulation.steps();
    }
    for (const auto& entry : fs::recursive_directory_iterator(folder))
        if (entry.is_regular_file()) result.bytes += double(entry.file_size());
    fs::remove_all(folder);
    return result;
}

void expectNear(const lab::Forecast& told, const Taken& found)
{
    constexpr double kSteps = 2, kBytes = 1.2;
    EXPECT_LT(told.steps, kSteps * found.steps);
    EXPECT_GT(told.steps, found.steps / kSteps);
    EXPECT_LT(told.bytes, kBytes * found.bytes);
    EXPECT_GT(told.bytes, found.bytes / kBytes);
}

TEST(Forecast, OfASmallSceneIsTheRunItself)
{
    const scene::Scene scene = shipped("slit_plate", {"time.frames=[1, 20]"});
    const Taken found = run(scene);
    const lab::Forecast told = foretold(scene, {.seconds = kNoHaste});
    EXPECT_EQ(told.wider, 1);
    EXPECT_EQ(told.simulatedShare, 1);
    EXPECT_EQ(told.steps, found.steps);
    EXPECT_GT(told.seconds, 0);
    expectNear(told, found);
}

TEST(Forecast, FromWiderVoxelsKnowsHowManyStepsAndBytesTearingTakes)
{
    for (const double wider : {1.5, 2.}) {
        const scene::Scene scene = shipped("notched_block", {"grid.voxel_size=0.04", "time.frames=[1, 24]"});
        const lab::Forecast told = foretold(scene, {.seconds = kNoHaste, .wider = wider});
        EXPECT_EQ(told.wider, wider);
        EXPECT_EQ(told.measuredSteps, 5);
        expectNear(told, run(scene));
    }
}

TEST(Forecast, OfThingsThatTouchOrAreFixedInTime)
{
    const scene::Scene tumble = shipped("tumble", {"time.frames=[1, 30]"});
    expectNear(foretold(tumble, {.seconds = kNoHaste, .wider = 1.5}), run(tumble));
    const scene::Scene bar = shipped("bar", {"time.substeps=3", "time.frames=[1, 12]"});
    const lab::Forecast told = foretold(bar, {.seconds = kNoHaste, .wider = 2});
    EXPECT_EQ(told.steps, 3 * 11);
    expectNear(told, run(bar));
}

TEST(Forecast, CountsAllCheckpointsWhereAllAreKept)
{
    const scene::Scene bar = shipped("bar", {"time.frames=[1, 12]"});
    const lab::Forecast two = foretold(bar, {.seconds = kNoHaste}),
                        all = foretold(bar, {.seconds = kNoHaste, .keepsCheckpoints = true});
    EXPECT_DOUBLE_EQ(all.checkpointBytes, 6 * two.checkpointBytes);
}

/// Distances are known to a depth, so a large collider takes memory by its surface.
TEST(Estimate, CollidersOfFilesTakeMemoryByTheirSurfaceWhereTheyAreDeep)
{
    const std::string mesh = std::string(VDBFRAC_SOURCE) + "/data/meshes/gingerbread_man.obj";
    const auto bytes = [&](int scale) {
        const std::string shape = "{ mesh = { file = \"" + mesh + "\", scale = " + std::to_string(scale) + " } }";
        const scene::Scene scene =
            shipped("notched_block", {"grid.voxel_size=0.05", "collider=[{ name = \"man\", shape = " + shape + " }]"});
        return core::estimateScene(scene, ~std::uint64_t{0}, effects::bytesPerTet(scene)).colliderBytes;
    };
    EXPECT_NEAR(bytes(80) / bytes(40), 4, .1);
    EXPECT_GT(bytes(2) / bytes(1), 6);  // by its volume
}

}  // namespace
