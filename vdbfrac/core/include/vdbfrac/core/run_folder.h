// The folder a run leaves behind: frames, manifest, statistics. Every file whole or not there.
#pragma once

#include <vdbfrac/base/background.h>
#include <vdbfrac/base/folder_lock.h>
#include <vdbfrac/base/primitive.h>
#include <vdbfrac/core/archive.h>
#include <vdbfrac/core/branch.h>
#include <vdbfrac/core/simulation.h>
#include <vdbfrac/scene/key.h>
#include <vdbfrac/scene/scene.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace vdbfrac::core {

class Drawing;

/// A file of a frame, with what it takes to tell whether it is still the one that was written.
struct WrittenFile {
    std::string path;  ///< relative to the folder
    std::uint64_t bytes = 0;
    std::string checksum;  ///< XXH3, hexadecimal
};

struct FrameRecord {
    int frame = 0;
    double time = 0;  ///< s
    std::string stateHash;
    std::vector<WrittenFile> files;
    Bounds drawn{Vec3::Zero(), Vec3::Zero()};  ///< box round what is drawn [m]; of no size where nothing is
    double squeeze = 1;  ///< least volume of a body over that at rest, before drawing moves points
};

/// From which checkpoints a run may go on, and how.
struct Resume {
    std::string settings;                             ///< what it depends on, as writeCheckpoint got it
    int lastFrame = std::numeric_limits<int>::max();  ///< no frame after this one; only a branch may go back to it
    std::uint64_t memoryLimit = ~std::uint64_t{0};    ///< bytes
    bool mayBranch = false;                           ///< settings may differ as far as core/branch.h allows
    /// A simulation of the scene with voxels twice as wide that has made no step: asked for when a branch is finer.
    std::function<Simulation&()> wider = {};
};

/// What output.vdb can list in any scene. Effects bring more.
scene::Vocabulary::Fields outputFields();

/// Throws InputError for a field of output.vdb that nothing makes, neither the core nor an effect in the stages.
void requireSources(const scene::Scene& scene, const Stages& stages);

/// The folder of the run that a file is one of; empty where it is of none.
std::filesystem::path runOf(const std::filesystem::path& file);

/// What becomes of an earlier run in the folder. `replace` and `keep` take only folders whose run.json is of this
/// program and none of whose files the scene needs; `replace` removes what that run.json lists, and nothing else.
enum class ExistingRun { refuse, replace, keep };

class RunFolder {
public:
    /// Takes the folder for a simulation that has made no step. What is in it changes with the first call that writes
    /// or goes on: until then a mistake costs nothing. Throws FileError; InputError for an output field that nothing
    /// makes, or where files of the scene would be lost.
    RunFolder(std::filesystem::path folder, const scene::Scene& scene, const Simulation& simulation,
              ExistingRun existing);

    const std::filesystem::path& path() const { return folder_; }
    /// Has this run begun to write into it? Until then what is in there is another's.
    bool isOpen() const { return isOpen_; }
    /// What the user should know of what is drawn, a sentence each.
    std::span<const std::string> notes() const;

    /// What was handed over is finished; an error of the writer that no call has thrown is lost.
    ~RunFolder();

    /// Copies what a frame writes and hands it to a writer, which works beside the next steps: .vdb and .obj, and
    /// stats.csv and run.json with all there is so far, as often as 2 % of the time allow. Waits while two more frames
    /// are unwritten: three are in memory at most. Returns the hash of the state. What the writer throws (FileError) is
    /// thrown by the next call, or by finish.
    std::string writeFrame(const Simulation& simulation, int frame);
    /// Hands a copy of the state to the writer, which makes ckpt/SCENE.STEP.ckpt of it, and adds the records since the
    /// last one to ckpt/SCENE.records; the last two are kept. `settings`: what the run depends on, as text. Does
    /// nothing when the last step has a checkpoint.
    void writeCheckpoint(const Simulation& simulation, const std::string& settings);
    /// Takes a simulation of the same scene that has made no step to where the newest checkpoint was written. Damaged
    /// ones are passed over; `notes` says so. Steps and frames so far become those of this run; where it may branch,
    /// files of later frames are removed. False when there is
    /// neither a checkpoint nor a frame. Throws FileError when no checkpoint can be used, InputError when settings,
    /// bodies or program are not those of the run.
    bool resume(Simulation& simulation, const Resume& how, std::vector<std::string>& notes);
    /// The same from the run in another folder, whose frames up to there are copied into this one. False when there is
    /// neither a checkpoint nor a frame in it.
    bool branchFrom(const std::filesystem::path& run, Simulation& simulation, const Resume& how,
                    std::vector<std::string>& notes);
    /// No checkpoint is removed from here on but those that a branch leaves behind.
    void keepCheckpoints();
    void addStep(const StepRecord& step) { steps_.push_back(step); }
    /// After the last frame, where output.point_cache asks for it. `simulation` is read until finish().
    void writePointCache(const Simulation& simulation);
    /// Waits for the writer; marks the manifest as finished with a status word, and with what went wrong.
    void finish(const Simulation& simulation, const std::string& status, const std::string& error = "");

    const std::vector<StepRecord>& steps() const { return steps_; }
    /// Frames that are written. After finish only: until then the writer adds to them.
    const std::vector<FrameRecord>& frames() const;
    /// What frames of a run that was resumed have lost, a sentence: it does not make them again.
    const std::string& lostFiles() const { return lostFiles_; }
    /// What the point cache lacks, a sentence; after finish only.
    const std::string& pointCacheLacks() const;
    /// After finish only. Stages: "snapshot", copying what frames write; "draw", the drawn surface; "output", making
    /// files of it, beside the steps; "wait", how long the steps stood still for the writer.
    Ledger work() const;

private:
    class Writer;

    struct Found;

    /// Makes the folder ready to be written to, once.
    void open();
    std::vector<StepRecord> newSteps();
    void handOver(std::function<void()> job);
    std::optional<Found> newestIn(const std::filesystem::path& run, const Resume& how, std::vector<std::string>& notes);
    void goOn(Simulation& simulation, const Resume& how, const Found& found, std::vector<std::string>& notes);
    void takeState(Simulation& simulation, const Resume& how, const Archive& archive, const Branch& branch,
                   std::vector<std::string>& notes);
    void noteBranch(const Branch& branch, const Found& found, const Simulation& simulation,
                    std::vector<std::string>& notes);

    std::filesystem::path folder_;
    FolderLock lock_;
    std::vector<std::string> removes_;  // patterns of the earlier run's files that it replaces
    std::string lostFiles_;
    bool isOpen_ = false;
    scene::Scene scene_;
    std::vector<StepRecord> steps_;
    std::size_t handedOver_ = 0;                 // steps that the writer knows
    int checkpointed_ = -1;                      // step of the last checkpoint
    std::string bodyFilesHash_, collidersHash_;  // of what the files of their shapes hold
    std::string restHash_;                       // of the state before the first step
    std::string bodiesHash_;                     // of the bodies then
    std::vector<BranchRecord> branches_;
    Ledger work_;
    std::unique_ptr<Drawing> drawing_;  // when frames or a point cache hold something drawn
    std::unique_ptr<Writer> writer_;
    BackgroundQueue queue_;  // last: it ends before what its jobs use
};

/// The scene's file and those that it names.
std::vector<std::filesystem::path> inputsOf(const scene::Scene& scene);

/// Paths of the checkpoints in a run's folder, oldest first.
std::vector<std::filesystem::path> checkpointsIn(const std::filesystem::path& folder);
/// Throws FileError where a checkpoint, or the records in its folder that belong to it, are not whole.
void verifyCheckpoint(const std::filesystem::path& file, std::uint64_t memoryLimit);

/// The largest of any step.
double maxUnnamedShare(const std::vector<StepRecord>& steps);

/// All of stats.csv: a header and a row a step. docs/output.md explains the columns.
std::string statsText(const std::vector<StepRecord>& steps, const scene::Scene& scene);

}  // namespace vdbfrac::core
