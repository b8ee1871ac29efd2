// Checkpoints: a run that goes on from one has the bits of a run that was never interrupted.
#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/core/archive.h>
#include <vdbfrac/core/run_folder.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>

#include <unistd.h>

using namespace vdbfrac;
using lab::SceneRun;
namespace fs = std::filesystem;

namespace {

constexpr int kFrames = 6;

/// A notched bar that tears beside one that does not.
std::string tearingBars()
{
    std::string s =
        "version = 1\nname = \"bars\"\n[time]\nframes = [1, 6]\nfps = 4\n[grid]\nvoxel_size = 0.1\n[material.m]\n"
        "youngs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n";
    for (const char* x : {"0", "1"}) {
        const std::string name = std::string("bar") + x;
        s += "[[body]]\nname = \"" + name + "\"\nmaterial = \"m\"\nshape = { box = { size = [0.4, 1, 0.4], center = [" +
             x + ", 0, 0] } }\n";
        if (*x == '0') s += "cut = [{ cylinder = { axis = \"z\", radius = 0.1, center = [0.2, 0, 0] } }]\n";
        for (const char* side : {"", "-"})
            s += "[[grip]]\nbody = \"" + name + "\"\nregion = { box = { size = [3, 0.1, 1], center = [0, " + side +
                 "0.4, 0] } }\nmove = { velocity = [0, " + side + "0.15, 0] }\n";
    }
    return s +
           "[damping]\nstiffness = 0.002\n[fracture]\ntoughness = 60\n[output]\nvdb = [\"phi\", \"arrival\"]\nobj = "
           "true\n";
}

/// All hashes of the state, after each step.
std::vector<std::uint64_t> hashes(SceneRun& run)
{
    std::vector<std::uint64_t> all;
    while (!run.atEnd()) {
        run.step();
        all.push_back(run.simulation.stateHash());
    }
    return all;
}

class Resumed : public testing::TestWithParam<std::vector<std::string>> {};

TEST_P(Resumed, StepsHaveTheBitsOfARunThatWasNeverInterrupted)
{
    SceneRun whole(tearingBars(), GetParam());
    const std::vector<std::uint64_t> expected = hashes(whole);
    ASSERT_GE(expected.size(), 5u);
    if (whole.scene.time.lastFrame == kFrames) {
        EXPECT_GT(whole.work.countOf("cut", "cells"), 0);
    }
    // Before the first step, in mid-frame, and when all is torn; on another number of threads.
    for (const std::size_t steps : {std::size_t{0}, expected.size() / 3, expected.size() / 2, expected.size() - 1}) {
        core::Archive archive;
        {
            SceneRun first(tearingBars(), GetParam());
            for (std::size_t i = 0; i < steps; ++i) first.step();
            first.simulation.save(archive);
        }
        const ThreadLimit one(1);
        SceneRun second(tearingBars(), GetParam());
        second.simulation.restoreFrom(archive);
        EXPECT_EQ(std::size_t(second.simulation.steps()), steps);
        const std::vector<std::uint64_t> rest = hashes(second);
        EXPECT_EQ(rest, std::vector<std::uint64_t>(expected.begin() + std::ptrdiff_t(steps), expected.end()))
            << "after " << steps;
    }
}

INSTANTIATE_TEST_SUITE_P(
    Settings, Resumed,
    testing::Values(
        std::vector<std::string>{}, std::vector<std::string>{"grip.0.until=0.4", "grip.3.until=0.5"},
        std::vector<std::string>{"grip.0.until=0.4", "solver.integrator=\"static\""},
        std::vector<std::string>{"grip.0.until=0.4", "contact.friction=0.2", "sleep.after=0.1", "sleep.speed=0.1"},
        std::vector<std::string>{"solver.linear_solver=\"multigrid\""},
        std::vector<std::string>{"solver.linear_solver=\"direct\""},
        std::vector<std::string>{"solver.integrator=\"midpoint\""},
        std::vector<std::string>{"solver.integrator=\"sdirk2\""},
        std::vector<std::string>{"solver.integrator=\"static\""}, std::vector<std::string>{"grid.lattice=\"five\""},
        std::vector<std::string>{"grid.lattice=\"delaunay\""},
        std::vector<std::string>{"grid.coarsening=2", "fracture.grip_margin=0.1", "fracture.toughness=20"},
        std::vector<std::string>{"grid.surface=\"whole_tets\"", "contact={}",
                                 "collider=[{ shape = { halfspace = { normal = [0, 0, -1], offset = 0.21 } }, "
                                 "move = { velocity = [0, 0, 0.04] } }]"},
        std::vector<std::string>{"fracture.relevel_every=3"}, std::vector<std::string>{"grid.half_width=8"},
        std::vector<std::string>{"body.0.shape={ box = { size = [0.8, 1, 0.8] } }", "grid.voxel_size=0.1"},
        std::vector<std::string>{"solver.precision=\"double\""},
        std::vector<std::string>{"volume={ least = 1, stiffness = 50 }"},
        std::vector<std::string>{"volume={ least = 1, stiffness = 50 }", "time.frames=[1,2]", "damping.stiffness=0",
                                 "solver.integrator=\"symplectic_euler\""},
        std::vector<std::string>{"collider=[{ shape = { halfspace = { normal = [0, 0, -1], offset = 0.21 } }, "
                                 "move = { velocity = [0, 0, 0.04] } }]"},
        std::vector<std::string>{"contact={}", "body.1.shape.box.center=[0.41, 0, 0]"},
        std::vector<std::string>{"contact={}", "body.1.shape.box.center=[0.41, 0, 0]", "time.substeps=3"},
        std::vector<std::string>{"contact={}", "body.1.shape.box.center=[0.41, 0, 0]", "time.frames=[1,2]",
                                 "damping.stiffness=0", "solver.integrator=\"symplectic_euler\"",
                                 "collider=[{ shape = { halfspace = { normal = [0, 0, -1], offset = 0.21 } }, "
                                 "move = { velocity = [0, 0, 0.04] } }]"},
        std::vector<std::string>{"solver.integrator=\"symplectic_euler\"", "time.frames=[1,2]",
                                 "damping.stiffness=0"}));

TEST(Checkpoint, HoldsTheStateToTheBit)
{
    SceneRun run(tearingBars());
    run.toFrame(5);
    ASSERT_GT(run.work.countOf("cut", "cells"), 0);
    core::Archive archive;
    run.simulation.save(archive);
    SceneRun other(tearingBars());
    other.simulation.restoreFrom(archive);
    EXPECT_EQ(other.simulation.stateHash(), run.simulation.stateHash());
    EXPECT_EQ(other.simulation.volume(), run.simulation.volume());
    EXPECT_EQ(other.simulation.startVolume(), run.simulation.startVolume());
    core::Archive again;
    other.simulation.save(again);
    EXPECT_EQ(again.checksum(), archive.checksum());
}

TEST(Checkpoint, OfAnotherSceneIsRefused)
{
    core::Archive archive;
    SceneRun(tearingBars()).simulation.save(archive);
    SceneRun finer(tearingBars(), {"grid.voxel_size=0.08"});
    EXPECT_THROW(finer.simulation.restoreFrom(archive), FileError);
    SceneRun thinner(tearingBars(), {"body.0.shape={ box = { size = [0.3, 1, 0.4] } }"});
    EXPECT_THROW(thinner.simulation.restoreFrom(archive), FileError);
    SceneRun renamed(tearingBars(), {"body.0.name=\"other\"", "grip.0.body=\"other\"", "grip.1.body=\"other\""});
    EXPECT_THROW(renamed.simulation.restoreFrom(archive), FileError);
}

class CheckpointFolder : public testing::Test {
protected:
    CheckpointFolder() { fs::remove_all(folder_); }
    ~CheckpointFolder() override { fs::remove_all(folder_); }

    core::RunFolder open(const SceneRun& run, core::ExistingRun existing)
    {
        return {folder_, run.scene, run.simulation, existing};
    }
    /// Runs to a frame, with a checkpoint at each.
    static void writeTo(SceneRun& run, core::RunFolder& folder, int last)
    {
        if (run.simulation.steps() == 0) folder.writeCheckpoint(run.simulation, "settings");
        for (int frame = run.simulation.framesDone() + 1 + (run.simulation.steps() > 0); frame <= last; ++frame) {
            while (run.simulation.framesDone() < frame - 1) folder.addStep(run.step());
            folder.writeFrame(run.simulation, frame);
            folder.writeCheckpoint(run.simulation, "settings");
        }
    }
    std::vector<fs::path> checkpoints() const { return core::checkpointsIn(folder_); }
    void runTo(int last)
    {
        SceneRun run(tearingBars());
        core::RunFolder folder = open(run, core::ExistingRun::replace);
        writeTo(run, folder, last);
        folder.finish(run.simulation, "stopped");
    }

    fs::path folder_ = fs::temp_directory_path() / ("vdbfrac-checkpoints-" + std::to_string(::getpid()));
};

TEST_F(CheckpointFolder, ResumedRunsLeaveTheSameFilesAndTwoCheckpoints)
{
    SceneRun whole(tearingBars());
    std::string expected;
    {
        core::RunFolder folder = open(whole, core::ExistingRun::replace);
        writeTo(whole, folder, kFrames);
        folder.finish(whole.simulation, "done");
        for (const core::FrameRecord& f : folder.frames()) expected += f.stateHash + f.files.at(1).checksum;
    }
    EXPECT_EQ(checkpoints().size(), 2u);
    runTo(3);
    SceneRun rest(tearingBars());
    core::RunFolder folder = open(rest, core::ExistingRun::keep);
    std::vector<std::string> notes;
    ASSERT_TRUE(folder.resume(rest.simulation, {"settings"}, notes));
    EXPECT_TRUE(notes.empty());
    EXPECT_EQ(folder.frames().size(), 3u);
    writeTo(rest, folder, kFrames);
    folder.finish(rest.simulation, "done");
    std::string found;
    for (const core::FrameRecord& f : folder.frames()) found += f.stateHash + f.files.at(1).checksum;
    EXPECT_EQ(found, expected);
    EXPECT_EQ(checkpoints().size(), 2u);
    // Steps too, but for the seconds they took.
    ASSERT_EQ(folder.steps().size(), whole.steps.size());
    for (std::size_t i = 0; i < whole.steps.size(); ++i) {
        const core::StepRecord &a = folder.steps()[i], &b = whole.steps[i];
        EXPECT_EQ(std::tie(a.step, a.time, a.dt, a.outcome, a.newtonIterations, a.linearIterations, a.residual,
                           a.kineticEnergy, a.elasticEnergy, a.volume),
                  std::tie(b.step, b.time, b.dt, b.outcome, b.newtonIterations, b.linearIterations, b.residual,
                           b.kineticEnergy, b.elasticEnergy, b.volume));
        EXPECT_EQ(a.gripLoad, b.gripLoad);
        ASSERT_EQ(a.work.stages().size(), b.work.stages().size());
        for (const StageWork& stage : b.work.stages())
            for (const auto& [what, n] : stage.counts)
                EXPECT_EQ(a.work.countOf(stage.name, what), n) << stage.name << " " << what;
    }
}

TEST_F(CheckpointFolder, RecordsGrowByWhatIsNewAndCheckpointsDoNotGrow)
{
    // A body at rest: what a checkpoint has of the state does not change, and each frame adds the same to the records.
    const std::string scene =
        "version = 1\nname = \"bars\"\ntime = { frames = [1, 400], fps = 24, substeps = 1 }\ngrid.voxel_size = "
        "0.25\n[[body]]\nname = \"b\"\n"
        "shape = { box = { size = [0.9, 0.9, 0.9] } }\nmaterial = \"m\"\n[material.m]\nyoungs_modulus = "
        "1e5\npoisson_ratio = 0.3\ndensity = 1000\n"
        "[output]\nobj = false\nvdb = []\n";
    SceneRun run(scene);
    core::RunFolder folder = open(run, core::ExistingRun::replace);
    const auto bytes = [&](int last) {
        writeTo(run, folder, last);
        folder.finish(run.simulation, "running");
        return std::pair(double(fs::file_size(folder_ / "ckpt/bars.records")),
                         double(fs::file_size(checkpoints().back())));
    };
    const auto [early, earlyCheckpoint] = bytes(50);
    const auto [late, lateCheckpoint] = bytes(200);
    EXPECT_NEAR(late / early, 199. / 49, 0.02);        // steps; their numbers have more digits
    EXPECT_NEAR(lateCheckpoint, earlyCheckpoint, 16);  // digits
}

TEST_F(CheckpointFolder, ADamagedCheckpointIsPassedOverAndNamed)
{
    runTo(3);
    const std::vector<fs::path> files = checkpoints();
    ASSERT_EQ(files.size(), 2u);
    std::string bytes = readText(files[1]);
    bytes[bytes.size() / 2] = char(bytes[bytes.size() / 2] ^ 1);
    writeText(files[1], bytes);
    {
        SceneRun run(tearingBars());
        core::RunFolder folder = open(run, core::ExistingRun::keep);
        std::vector<std::string> notes;
        ASSERT_TRUE(folder.resume(run.simulation, {"settings"}, notes));
        ASSERT_EQ(notes.size(), 1u);
        EXPECT_NE(notes[0].find(files[1].filename().string()), std::string::npos) << notes[0];
        EXPECT_EQ(folder.frames().back().frame, 2);
    }
    writeText(files[0], "no more than this");
    SceneRun run(tearingBars());
    core::RunFolder folder = open(run, core::ExistingRun::keep);
    std::vector<std::string> notes;
    EXPECT_THROW(folder.resume(run.simulation, {"settings"}, notes), FileError);
}

TEST_F(CheckpointFolder, OtherSettingsAndOtherBodiesAreRefused)
{
    runTo(2);
    std::vector<std::string> notes;
    {
        SceneRun run(tearingBars());
        core::RunFolder folder = open(run, core::ExistingRun::keep);
        try {
            folder.resume(run.simulation, {"settings\nmore"}, notes);
            FAIL() << "nothing was thrown";
        } catch (const InputError& e) {
            EXPECT_NE(std::string(e.what()).find("'more' was its end"), std::string::npos) << e.what();
        }
    }
    SceneRun other(tearingBars(), {"body.0.cut=[]"});
    core::RunFolder folder = open(other, core::ExistingRun::keep);
    EXPECT_THROW(folder.resume(other.simulation, {"settings"}, notes), InputError);
}

TEST_F(CheckpointFolder, GoesBackToAnEarlierFrameWhenAskedTo)
{
    runTo(3);
    std::vector<std::string> notes;
    {
        SceneRun run(tearingBars());
        core::RunFolder folder = open(run, core::ExistingRun::keep);
        core::Resume back{"settings", 2};
        EXPECT_THROW(folder.resume(run.simulation, back, notes), InputError);  // not by itself: it drops frame 3
        back.mayBranch = true;
        ASSERT_TRUE(folder.resume(run.simulation, back, notes));
        EXPECT_EQ(folder.frames().back().frame, 2);
    }
    SceneRun early(tearingBars());
    core::RunFolder same = open(early, core::ExistingRun::keep);
    core::Resume farther{"settings", 1};
    farther.mayBranch = true;
    EXPECT_THROW(same.resume(early.simulation, farther, notes), FileError);  // of two, the oldest is frame 2's
}

TEST_F(CheckpointFolder, OneRunAtATimeWritesIntoAFolder)
{
    SceneRun run(tearingBars());
    {
        const core::RunFolder folder = open(run, core::ExistingRun::replace);
        EXPECT_THROW(open(run, core::ExistingRun::keep), FileError);
        EXPECT_THROW(open(run, core::ExistingRun::replace), FileError);
    }
    EXPECT_NO_THROW(open(run, core::ExistingRun::replace));
}

/// A checkpoint with another value in one array.
template <class T>
core::Archive changed(const core::Archive& archive, const std::string& name, std::size_t at, const T& value)
{
    core::Archive other = archive;
    std::vector<T> values = archive.get<T>(name);
    values.at(at) = value;
    other.put(name, values);
    return other;
}

TEST(Checkpoint, WhatNoRunLeadsToIsRefused)
{
    SceneRun run(tearingBars());
    run.toFrame(5);
    core::Archive sound;
    run.simulation.save(sound);
    const auto refused = [&](const core::Archive& archive) {
        SceneRun other(tearingBars());
        EXPECT_THROW(other.simulation.restoreFrom(archive), FileError);
    };
    EXPECT_NO_THROW(SceneRun(tearingBars()).simulation.restoreFrom(sound));
    const double nan = std::numeric_limits<double>::quiet_NaN();
    refused(changed(sound, "x", 3, Vec3(0, nan, 0)));
    refused(changed(sound, "v", 3, Vec3(0, 0, INFINITY)));
    refused(changed(sound, "time", 0, nan));
    refused(changed(sound, "time", 0, 1e300));
    refused(changed(sound, "time", 1, 0.));
    refused(changed(sound, "step", 0, std::int64_t{-1}));
    refused(changed(sound, "next_fragment", 0, 4000000000u));
    refused(changed(sound, "body.bar0.fragment.of_node", 0, 4000000000u));
    refused(changed(sound, "body.bar1.fragment.id", 0, 0xffffffffu));
    refused(changed(sound, "body.bar0.leaf.phi", 0, -1.f));
    refused(changed(sound, "body.bar0.leaf.phi", 0, 9.f));
    refused(changed(sound, "body.bar0.leaf.phi", 0, std::numeric_limits<float>::quiet_NaN()));
    refused(changed(sound, "body.bar0.leaf.origin", 0, Coord{1, 0, 0}));
    refused(changed(sound, "body.bar0.leaf.origin", 0, Coord{8000, 0, 0}));
    refused(changed(sound, "body.bar0.leaf.origin", 0, sound.get<Coord>("body.bar0.leaf.origin")[1]));
    refused(changed(sound, "fracture.limit", 0, -1.));
    refused(changed(sound, "fracture.bar0.updates", 0, std::int64_t{-1}));
    refused(changed(sound, "fracture.bar0.arrival.voxels", 0, Coord{8000, 0, 0}));
    refused(changed(sound, "fracture.bar0.arrival.times", 0, INFINITY));
}

TEST(Archive, GivesBackWhatWasPutAndNothingElse)
{
    core::Archive archive;
    archive.put("numbers", std::vector<double>{1, 2, 3});
    archive.put("voxels", std::vector<Coord>{{1, -2, 3}});
    archive.put("none", std::vector<float>{});
    archive.putText("text", "words");
    const fs::path file = fs::temp_directory_path() / ("vdbfrac-archive-" + std::to_string(::getpid()));
    archive.write(file);
    const core::Archive read = core::Archive::read(file);
    EXPECT_EQ(read.get<double>("numbers", 3), (std::vector<double>{1, 2, 3}));
    EXPECT_EQ(read.get<Coord>("voxels")[0], (Coord{1, -2, 3}));
    EXPECT_TRUE(read.get<float>("none").empty());
    EXPECT_EQ(read.getText("text"), "words");
    EXPECT_THROW(read.get<float>("numbers"), FileError);
    EXPECT_THROW(read.get<double>("numbers", 4), FileError);
    EXPECT_THROW(read.get<double>("other"), FileError);
    EXPECT_THROW(core::Archive::read(file, 10), LimitError);
    const std::string bytes = readText(file);
    for (std::size_t cut = 0; cut < bytes.size(); ++cut)
        EXPECT_THROW(core::Archive::parse(bytes.substr(0, cut), "cut"), FileError) << cut;
    for (std::size_t at = 0; at < bytes.size(); ++at) {
        std::string broken = bytes;
        broken[at] = char(broken[at] ^ 0x10);
        EXPECT_THROW(core::Archive::parse(broken, "broken"), FileError) << at;
    }
    fs::remove(file);
}

}  // namespace
