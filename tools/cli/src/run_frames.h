// The frames of a finished run, from its manifest.
#pragma once

#include <vdbfrac/base/vec.h>

#include <filesystem>
#include <string>
#include <vector>

namespace vdbfrac::cli {

struct RunFrame {
    int frame = 0;
    std::filesystem::path obj, ply, vdb;  ///< empty where the run wrote none
    std::vector<Vec3> bounds;             ///< lower and upper corner of what is drawn [m]; empty without any
};

struct RunFrames {
    std::string scene;
    double voxelSize = 0;  ///< m
    std::vector<RunFrame> frames;
};

/// Reads run.json of a folder that 'vdbfrac sim -o' wrote. Throws FileError, InputError.
RunFrames readRunFrames(const std::filesystem::path& folder);

}  // namespace vdbfrac::cli
