// The folder a run leaves behind, while its frames are written beside the steps.
#include "notched_bar.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/hash.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/core/run_folder.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <nlohmann/json.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <stdexcept>

#include <unistd.h>

using namespace vdbfrac;
using lab::SceneRun;
namespace fs = std::filesystem;

namespace {

constexpr int kFrames = 8;

/// A notched bar that tears, with all kinds of output.
std::string tornBar()
{
    return test::NotchedBar().text(std::string(test::kTear) + R"([output]
vdb = ["phi", "energy", "arrival", "surface", "vel"]
obj = true
)");
}

class RunFolderTest : public testing::Test {
protected:
    RunFolderTest() { fs::remove_all(folder_); }
    ~RunFolderTest() override { fs::remove_all(folder_); }

    core::RunFolder open(const SceneRun& run)
    {
        return {folder_, run.scene, run.simulation, core::ExistingRun::replace};
    }
    /// Runs to a frame and writes each.
    static void writeTo(SceneRun& run, core::RunFolder& folder, int last)
    {
        for (int frame = 1; frame <= last; ++frame) {
            const std::size_t before = run.steps.size();
            run.toFrame(frame);
            for (std::size_t i = before; i < run.steps.size(); ++i) folder.addStep(run.steps[i]);
            folder.writeFrame(run.simulation, frame);
        }
    }
    nlohmann::json manifest() const { return nlohmann::json::parse(readText(folder_ / "run.json")); }

    fs::path folder_ = fs::temp_directory_path() / ("vdbfrac-run-folder-" + std::to_string(::getpid()));
};

TEST_F(RunFolderTest, AllFramesAreThereInOrderAndAreWhatTheManifestSays)
{
    SceneRun run(tornBar());
    core::RunFolder folder = open(run);
    writeTo(run, folder, kFrames);
    folder.finish(run.simulation, "done");
    EXPECT_GT(run.work.countOf("cut", "cells"), 0);
    const auto m = manifest();
    EXPECT_EQ(m["status"], "done");
    EXPECT_EQ(m["steps"], run.steps.size());
    ASSERT_EQ(m["frames"].size(), std::size_t(kFrames));
    ASSERT_EQ(folder.frames().size(), std::size_t(kFrames));
    for (int i = 0; i < kFrames; ++i) {
        const auto& frame = m["frames"][std::size_t(i)];
        EXPECT_EQ(frame["frame"], i + 1);
        ASSERT_EQ(frame["files"].size(), 2u);
        for (const auto& file : frame["files"]) {
            const std::string content = readText(folder_ / file["path"].get<std::string>());
            EXPECT_EQ(content.size(), file["bytes"].get<std::size_t>());
            EXPECT_EQ(hexadecimal(hashBytes(content.data(), content.size())), file["xxh3"].get<std::string>());
        }
    }
    EXPECT_EQ(readText(folder_ / "stats.csv"), core::statsText(run.steps, run.scene));
    const Ledger work = folder.work();
    EXPECT_EQ(work.countOf("output", "calls"), kFrames);
    EXPECT_EQ(work.countOf("snapshot", "calls"), kFrames);
    EXPECT_GT(work.countOf("output", "bytes"), 0);
    EXPECT_GT(work.secondsOf("output"), 0);
}

TEST_F(RunFolderTest, RowsOfTheStatisticsHaveACellForEachNameWhateverGripsAreCalled)
{
    SceneRun run(tornBar(), {"grip.0.name='left, \"upper\"'"});
    run.step();
    std::istringstream text(core::statsText(run.steps, run.scene));
    std::string header, row;
    std::getline(text, header), std::getline(text, row);
    const std::vector<std::string> names = csvCells(header);
    EXPECT_EQ(csvCells(row).size(), names.size());
    EXPECT_EQ(std::ranges::count(names, "load_left, \"upper\"_x_N"), 1) << header;
}

TEST_F(RunFolderTest, AFrameHoldsTheStateItWasHandedOverIn)
{
    // Every frame as it is when the writer has all the time it wants, and when the steps go on at once.
    const auto frames = [&](bool waits, int threads) {
        const ThreadLimit limit(threads);
        SceneRun run(tornBar());
        core::RunFolder folder = open(run);
        for (int frame = 1; frame <= kFrames; ++frame) {
            run.toFrame(frame);
            folder.writeFrame(run.simulation, frame);
            if (waits) folder.finish(run.simulation, "running");
        }
        folder.finish(run.simulation, "done");
        std::vector<std::string> objs;
        for (const core::FrameRecord& f : folder.frames())
            objs.push_back(f.stateHash + readText(folder_ / f.files.at(1).path));
        return objs;
    };
    const auto expected = frames(true, 1);
    EXPECT_NE(expected.front(), expected.back());
    for (int threads : {1, 2}) EXPECT_EQ(frames(false, threads), expected) << threads;
}

TEST_F(RunFolderTest, FramesHandedOverAreFinishedWhenTheRunFails)
{
    SceneRun run(tornBar());
    try {
        core::RunFolder folder = open(run);
        writeTo(run, folder, 3);
        throw std::runtime_error("the solver gave up");
    } catch (const std::runtime_error&) {
    }
    const auto m = manifest();
    EXPECT_EQ(m["status"], "running");
    EXPECT_EQ(m["frames"].size(), 3u);
    for (const auto& frame : m["frames"])
        for (const auto& file : frame["files"]) EXPECT_TRUE(fs::exists(folder_ / file["path"].get<std::string>()));
    for (const auto& entry : fs::recursive_directory_iterator(folder_))
        EXPECT_FALSE(entry.path().filename().string().starts_with("."));
}

TEST_F(RunFolderTest, AnErrorOfTheWriterIsThrownInTheRunWithTheNameOfTheFile)
{
    SceneRun run(tornBar());
    core::RunFolder folder = open(run);
    fs::create_directories(folder_ / "obj" / "bar.0002.obj");  // in the way
    try {
        writeTo(run, folder, kFrames);
        folder.finish(run.simulation, "done");
        FAIL() << "nothing was thrown";
    } catch (const FileError& e) {
        EXPECT_NE(std::string(e.what()).find("bar.0002.obj: cannot be written"), std::string::npos) << e.what();
    }
}

}  // namespace
