// Pictures of frames of a run, all with one camera that sees all of them.
#pragma once

#include "run_frames.h"

#include <vdbfrac/pictures/render.h>

#include <vector>

namespace vdbfrac::cli {

struct PictureOptions {
    int width = 480, height = 480, samples = 16;  ///< pixels, rays a pixel
    Vec3 direction = Vec3(-0.55, -0.35, -1);      ///< of looking
    pictures::ColourBy colour = pictures::ColourBy::material;
};

/// What pictures are made of.
struct Scenery {
    std::vector<pictures::Subject> subjects;  ///< of the frames, with the colliders of the scene
    std::vector<Vec3> seen;                   ///< the points of the last of them, without colliders
    pictures::View view;
};

/// The run, with those of its frames that have an .obj. Throws InputError where none has, FileError.
RunFrames readDrawnRun(const std::filesystem::path& folder);

/// So many of the frames, spread over the run with the first and the last.
std::vector<RunFrame> spread(const std::vector<RunFrame>& frames, int count);

/// Throws InputError for a direction without length, FileError.
Scenery sceneryOf(const std::filesystem::path& folder, const RunFrames& run, const std::vector<RunFrame>& frames,
                  const PictureOptions& options);

/// Renders frames of a run in one row, smaller pictures for pages; writes and returns folder/preview/FILE.
std::filesystem::path writeSheet(const std::filesystem::path& folder, int count, const std::string& file);

}  // namespace vdbfrac::cli
