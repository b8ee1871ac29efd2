// The frames of a run, from its manifest.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/report/record.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace vdbfrac::report {

struct RunFrame {
    int frame = 0;
    double time = 0;                                                      ///< s
    std::filesystem::path obj, ply, vdb;                                  ///< empty where the run wrote none
    std::vector<std::pair<std::filesystem::path, std::uintmax_t>> files;  ///< all of them, with their bytes
    std::vector<Vec3> bounds;  ///< lower and upper corner of what is drawn [m]; empty without any
};

struct RunFrames {
    std::string scene;
    int lastFrame = 0;     ///< that it ends with, or was to
    double voxelSize = 0;  ///< m
    std::vector<RunFrame> frames;
};

/// Of the run in a folder, by its manifest. Throws InputError where that does not say them.
RunFrames framesOf(const Json& manifest, const std::filesystem::path& folder);
/// Reads run.json of a folder that 'vdbfrac sim -o' wrote. Throws FileError, InputError.
RunFrames readRunFrames(const std::filesystem::path& folder);

/// A frame that an option names. Throws InputError where the run ends before it.
int frameWithin(const std::filesystem::path& run, int frame, const char* option);

/// Throws FileError where a file of a frame is shorter than the run wrote it.
void requireWhole(const RunFrame& frame, const std::filesystem::path& file);

}  // namespace vdbfrac::report
