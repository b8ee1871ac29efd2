// Pictures of frames of a run, all with one camera that sees all of them.
#pragma once

#include "run_frames.h"

#include <vdbfrac/pictures/render.h>

#include <optional>
#include <string>
#include <vector>

namespace vdbfrac::cli {

struct PictureOptions {
    int width = 480, height = 480, samples = 16;  ///< pixels, rays a pixel
    Vec3 direction = Vec3(-0.55, -0.35, -1);      ///< of looking
    std::string colour = "material";              ///< or fragment, energy, margin, arrival
    std::string torn = "material";                ///< or red, as_others, or #rrggbb
    enum class Fit { frames, run, first };
    Fit fit = Fit::frames;  ///< the camera sees all that is in the pictures, in the run, or in the run's first frame
    std::optional<Vec3> eye = {}, target = {};  ///< m: where the camera is, and what it looks at
    double angle = 45;                          ///< degrees that the longer side of the picture shows
};

/// What pictures are made of.
struct Scenery {
    std::vector<pictures::Subject> subjects;  ///< of the frames, with the colliders of the scene
    std::vector<Vec3> seen;                   ///< the points of the last of them, without colliders
    pictures::View view;
    std::optional<pictures::Scale> scale;  ///< of colours that stand for values
    std::string scaleName;
    std::vector<std::string> notes;  ///< textures that are not drawn, and why
};

/// A picture of one of them, with the legend of its colours.
pictures::Image pictureOf(const Scenery& scenery, std::size_t frame, const pictures::View& view);

/// The run, with those of its frames that have an .obj. Throws InputError where none has, FileError.
RunFrames readDrawnRun(const std::filesystem::path& folder);

/// So many of the frames, spread over the run with the first and the last.
std::vector<RunFrame> spread(const std::vector<RunFrame>& frames, int count);

/// Throws InputError for a direction without length, FileError.
Scenery sceneryOf(const std::filesystem::path& folder, const RunFrames& run, const std::vector<RunFrame>& frames,
                  const PictureOptions& options);

/// Renders frames of a run side by side, with their numbers, smaller than pictures of their own are; of `count` 1 the
/// last.
pictures::Image sheetOf(const std::filesystem::path& folder, int count);

}  // namespace vdbfrac::cli
