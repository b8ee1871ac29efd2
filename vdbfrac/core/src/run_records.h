// Steps and frames of a run, as its manifest and its checkpoints keep them. Not installed.
#pragma once

#include <vdbfrac/core/archive.h>
#include <vdbfrac/core/run_folder.h>

#include <nlohmann/json.hpp>

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace vdbfrac::core {

nlohmann::json filesJson(std::span<const WrittenFile> files);
nlohmann::json framesJson(std::span<const FrameRecord> frames);
nlohmann::json branchesJson(std::span<const BranchRecord> branches);
/// What a checkpoint has of them. Throws FileError.
std::vector<BranchRecord> branchesOf(const Archive& archive);

void saveRecords(std::span<const StepRecord> steps, std::span<const FrameRecord> frames, Archive& archive);
/// Throw FileError for what saveRecords cannot have written.
std::vector<StepRecord> loadSteps(const Archive& archive);
std::vector<FrameRecord> loadFrames(const Archive& archive);

/// The records of a run as they come, in a file that only grows: blocks one behind the other, each the length of an
/// archive (8 bytes, little-endian) and the archive. A checkpoint says up to where the file belongs to it.
class RecordLog {
public:
    struct Mark {
        std::uint64_t bytes = 0, hash = 0;
    };
    struct Records {
        std::vector<StepRecord> steps;
        std::vector<FrameRecord> frames;
    };

    explicit RecordLog(std::filesystem::path file) : file_(std::move(file)) {}

    /// Adds a block behind the mark, on the disk when it returns; what was there is cut off. Throws FileError.
    Mark append(std::span<const StepRecord> steps, std::span<const FrameRecord> frames);
    /// All up to a mark, where the next block goes. Throws FileError when it is not what was written.
    Records goOnFrom(const Mark& mark);

private:
    std::filesystem::path file_;
    Mark mark_;
};

/// The records that a checkpoint of any run belongs to. Throws FileError.
RecordLog::Records recordsOf(const std::filesystem::path& checkpoint, const Archive& archive);

}  // namespace vdbfrac::core
