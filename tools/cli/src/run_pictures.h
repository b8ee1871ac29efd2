// Pictures of frames of a run, all with one camera that sees all of them.
#pragma once

#include <vdbfrac/report/run_frames.h>

#include <vdbfrac/pictures/render.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace vdbfrac::cli {

using report::RunFrame, report::RunFrames;

inline const Vec3 kDirection(-0.55, -0.35, -1);  ///< of looking, as a rule

struct PictureOptions {
    int width = 480, height = 480, samples = 16;  ///< pixels, rays a pixel
    std::optional<Vec3> direction = {};           ///< of looking; without it an eye looks at the middle of the frames
    std::string colour = "material";              ///< or fragment, energy, margin, arrival
    std::string torn = "material";                ///< or red, as_others, or #rrggbb
    enum class Fit { frames, run, first };
    Fit fit = Fit::frames;  ///< the camera sees all that is in the pictures, in the run, or in the run's first frame
    std::optional<Vec3> eye = {}, target = {};  ///< m: where the camera is, and what it looks at
    double angle = 45;                          ///< degrees that the longer side of the picture shows
};

/// What stands beside the bodies of a run.
struct Surroundings;

/// What pictures are made of: frames are read when one of them is made, as a run is larger than memory may be.
struct Scenery {
    std::vector<RunFrame> frames;
    pictures::Paint paint;
    std::string values;          ///< of points that colours stand for; empty: none
    pictures::Scale scale;       ///< of these values
    Vec3 origin = Vec3::Zero();  ///< m: pictures are made near the origin, wherever the bodies are
    std::shared_ptr<const Surroundings> surroundings;
    pictures::View view;
    std::vector<std::string> notes;  ///< textures that are not drawn, and why
};

/// The bodies in a frame, and with what stands beside them. Throw FileError.
pictures::Subject bodiesIn(const Scenery& scenery, std::size_t frame);
pictures::Subject subjectOf(const Scenery& scenery, std::size_t frame);
/// A picture of it, with the legend of its colours.
pictures::Image pictureOf(const Scenery& scenery, const pictures::Subject& subject, const pictures::View& view);
/// As one of many on a sheet, with a label.
pictures::Image tileOf(const pictures::Image& picture, const std::string& label);

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
