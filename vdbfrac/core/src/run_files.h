// Which files a run writes into its folder. The manifest lists them, and nothing else in there is ever removed. Not
// installed.
#pragma once

#include <vdbfrac/base/hash.h>
#include <vdbfrac/core/run_folder.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace vdbfrac::core {

inline constexpr const char* kManifest = "run.json";
inline constexpr const char* kCheckpointFolder = "ckpt";
inline constexpr const char* kCheckpointExtension = ".ckpt";
inline constexpr const char* kRecordsExtension = ".records";

/// Paths relative to the folder; "####" stands for a number of four digits or more. Checkpoints come first: they are
/// removed first, so that whoever is killed in between leaves none whose frames are gone.
std::vector<std::string> runFiles(const std::string& sceneName);

/// Is `path` one of those that a pattern stands for?
bool matches(std::string_view pattern, std::string_view path);

/// The patterns that the manifest of an earlier run lists. Throws FileError for a folder without a manifest of this
/// program; where it is lost, missing or no JSON, returns `ifLost` instead if that is not empty.
std::vector<std::string> filesOfEarlierRun(const std::filesystem::path& folder, const std::vector<std::string>& ifLost);

/// Of what the files of bodies or colliders hold. Throws FileError.
std::string filesHash(const auto& solids)
{
    std::uint64_t hash = 0;
    for (const auto& solid : solids)
        if (const std::filesystem::path* file = scene::fileOf(solid.shape)) hash = hashFile(*file, hash);
    return hexadecimal(hash);
}

/// Does its manifest list frames?
bool hasFrames(const std::filesystem::path& folder);

/// Did that run keep all its checkpoints? Where the manifest is lost, it may have.
bool mayKeepCheckpoints(const std::filesystem::path& folder);

/// Throws InputError when one of `inputs` is among the files that the patterns stand for. `what`: what would become of
/// it.
void requireApart(const std::filesystem::path& folder, const std::vector<std::string>& patterns,
                  const std::vector<std::filesystem::path>& inputs, const char* what);

/// Removes the files that the patterns stand for, in their order, then the folders that are empty. Throws FileError.
void removeRunFiles(const std::filesystem::path& folder, const std::vector<std::string>& patterns);

/// How many files of these frames, which a run will not make again, are missing or have another size: a sentence, empty
/// where there are none.
std::string lostFiles(const std::filesystem::path& folder, const std::vector<FrameRecord>& frames);

/// Removes what a run has in the folder of frames after `last`, the point cache, and, where there were such frames,
/// what else is made of all: the report, sheets and turntables. Checkpoints stay. Throws FileError.
void removeLaterFrames(const std::filesystem::path& folder, const std::string& sceneName, int last);

}  // namespace vdbfrac::core
