// The folder a run leaves behind: frames, manifest, statistics. Every file whole or not there.
#pragma once

#include <vdbfrac/core/simulation.h>
#include <vdbfrac/scene/scene.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace vdbfrac::core {

/// A file of a frame, with what it takes to tell whether it is still the one that was written.
struct WrittenFile {
    std::string path;            ///< relative to the folder
    std::uint64_t bytes = 0;
    std::string checksum;        ///< XXH3, hexadecimal
};

struct FrameRecord {
    int frame = 0;
    double time = 0;             ///< s
    std::string stateHash;
    std::vector<WrittenFile> files;
};

class RunFolder {
public:
    /// Makes the folder. A folder that is not empty is refused unless `overwrite`, which removes what an earlier run of
    /// this program left in it and nothing else. Throws FileError; InputError for an output field that nothing makes.
    RunFolder(std::filesystem::path folder, const scene::Scene& scene, const Stages& stages, bool overwrite);

    const std::filesystem::path& path() const { return folder_; }

    /// Writes .vdb and .obj of a frame, then stats.csv and run.json with all there is so far. Returns the frame's record.
    const FrameRecord& writeFrame(const Simulation& simulation, int frame);
    void addStep(const StepRecord& step) { steps_.push_back(step); }
    /// Marks the manifest as finished with a status word.
    void finish(const Simulation& simulation, const std::string& status);

    const std::vector<StepRecord>& steps() const { return steps_; }
    const std::vector<FrameRecord>& frames() const { return frames_; }

private:
    std::string sequenceName(const char* kind, int frame, const char* extension) const;
    grid::NamedGrid restField(const Simulation& simulation, const Body& body, const std::string& name) const;
    void writeVdbFrame(const Simulation& simulation, FrameRecord& record);
    void writeObjFrame(const Simulation& simulation, FrameRecord& record);
    void note(FrameRecord& record, const std::string& relative);
    void writeStats() const;
    void writeManifest(const Simulation& simulation, const std::string& status) const;

    std::filesystem::path folder_;
    scene::Scene scene_;
    std::vector<StepRecord> steps_;
    std::vector<FrameRecord> frames_;
};

/// All of stats.csv: a header and a row a step. docs/output.md explains the columns.
std::string statsText(const std::vector<StepRecord>& steps, const scene::Scene& scene);

}  // namespace vdbfrac::core
