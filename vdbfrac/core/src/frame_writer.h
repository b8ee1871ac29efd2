// What a frame writes, taken from the simulation, and the writer that makes files of it beside the next steps. Not
// installed.
#pragma once

#include "run_files.h"
#include "run_records.h"

#include <vdbfrac/core/drawing.h>
#include <vdbfrac/core/run_folder.h>
#include <vdbfrac/core/simulation.h>
#include <vdbfrac/scene/scene.h>

#include <chrono>
#include <filesystem>
#include <list>
#include <string>
#include <vector>

namespace vdbfrac::core {

/// What the manifest tells of the state, beside frames.
struct RunState {
    struct Entry {
        std::string body;
        tetmesh::Fragment fragment;
    };
    std::vector<Entry> fragments;
    double startVolume = 0, volume = 0;  // m^3
};
RunState runState(const Simulation& simulation);

/// All that is written of one frame; nothing in it belongs to the simulation, which goes on.
struct FrameData {
    FrameRecord record;                   // without files
    std::vector<StepRecord> steps;        // since the frame before
    std::list<grid::LevelSet> levelSets;  // what `grids` point to
    std::vector<grid::NamedGrid> grids;   // in the order of the file; those in world space are still empty
    std::vector<std::pair<std::string, std::vector<std::size_t>>> restValues;  // fields at rest: the grid of each body
    DrawnFrame drawn;                                                          // when something is made of it
    Archive motion;                                                            // of all nodes, when it is asked for
    RunState state;
};
FrameData takeFrame(const Simulation& simulation, const scene::Scene& scene, int frame);

/// Does a frame hold anything that is made of the drawn surface?
bool isDrawn(const scene::Output& output);

class RunFolder::Writer {
public:
    Writer(std::filesystem::path folder, const scene::Scene& scene);
    /// Writes the tables that are behind, as far as that is possible.
    ~Writer();

    /// Writes .vdb, .obj, .ply and .motion of a frame; and now and then stats.csv and run.json with all there is so
    /// far.
    void write(FrameData& data);
    /// Writes stats.csv and run.json, with what went wrong, if something did.
    void writeTables(const std::vector<StepRecord>& steps, const RunState& state, const std::string& status,
                     const std::string& error = "");
    /// Of all frames that were written.
    void writePointCache(const Simulation& simulation, const Drawing& drawing);
    /// Writes run.json alone, as it is before the first frame.
    void writeFirstManifest() const { writeManifest({}, kRunning); }

    /// Adds steps and frames so far to the archive and writes it; the last two checkpoints of the run are kept.
    void writeCheckpoint(Archive& archive, const std::vector<StepRecord>& steps);
    /// The records that a checkpoint belongs to. Throws FileError.
    RecordLog::Records readRecords(const Archive& archive);
    /// Goes on from them. `checkpoint`: the file's name.
    void goOnFrom(const std::string& checkpoint, RecordLog::Records records);
    /// Removes files of frames that the records do not have.
    void removeLater(const std::string& checkpoint) const;
    /// Copies the frames of another run into this folder, checks them, and goes on from its records. Throws FileError.
    void takeOver(const std::filesystem::path& run, RecordLog::Records records);
    void setBranches(std::vector<BranchRecord> branches) { branches_ = std::move(branches); }
    void keepCheckpoints() { keepsCheckpoints_ = true; }

    const std::vector<FrameRecord>& frames() const { return frames_; }
    std::size_t steps() const { return steps_.size(); }
    /// As PointCache::lacks() says of the one that was written.
    const std::string& pointCacheLacks() const { return pointCacheLacks_; }

private:
    static constexpr const char* kRunning = "running";

    std::string sequenceName(const char* kind, int frame, const char* extension) const;
    // Each writes a file of a frame, and returns its name in the folder.
    std::string writeVdb(FrameData& data) const;
    std::string writeObj(const FrameData& data) const;
    std::string writePly(const FrameData& data) const;
    std::string writeMotion(const FrameData& data) const;
    WrittenFile readBack(const std::string& relative) const;
    void writeManifest(const RunState& state, const std::string& status) const;
    void addSteps(const std::vector<StepRecord>& steps) { steps_.insert(steps_.end(), steps.begin(), steps.end()); }
    void writeAll(const std::string& status);

    std::filesystem::path folder_;
    scene::Scene scene_;
    std::vector<StepRecord> steps_;
    std::vector<FrameRecord> frames_;
    std::vector<WrittenFile> pointCache_;
    std::string pointCacheLacks_;
    RunState state_;     // of the last frame
    std::string error_;  // that has ended the run
    RecordLog log_;
    std::size_t loggedSteps_ = 0, loggedFrames_ = 0;
    std::vector<BranchRecord> branches_;
    std::vector<std::string> checkpoints_;             // names of those to keep
    bool keepsCheckpoints_ = false;                    // all of them
    bool behind_ = false;                              // tables lack frames or steps
    std::chrono::steady_clock::time_point written_{};  // when the tables were
    std::chrono::duration<double> took_{0};            // how long that took
};

}  // namespace vdbfrac::core
