#include "run_pictures.h"

#include "drawn_colliders.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/lab/study/study_table.h>
#include <vdbfrac/pictures/png_file.h>
#include <vdbfrac/pictures/texture.h>
#include <vdbfrac/scene/reader.h>
#include <vdbfrac/tetmesh/cache_files.h>
#include <vdbfrac/tetmesh/mtl_file.h>
#include <vdbfrac/tetmesh/obj_file.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <span>
#include <utility>

namespace vdbfrac::cli {

namespace fs = std::filesystem;

namespace {

Vec3 directionOf(const PictureOptions& options)
{
    const Vec3 direction = options.eye && options.target ? Vec3(*options.target - *options.eye) : options.direction;
    if (!(direction.norm() > 0))
        throw InputError({options.eye ? "--look-at" : "--direction", "there is no direction to look in", "",
                          options.eye ? "a point other than that of --eye" : "a vector with a length above 0"});
    return direction;
}

/// What all pictures have in common. `seen`: what the camera has to see.
pictures::View viewOf(const std::vector<Vec3>& seen, const PictureOptions& options, const Vec3& origin)
{
    const Vec3 direction = directionOf(options);
    pictures::View view;
    view.camera.angle = options.angle, view.camera.direction = direction;
    if (options.eye)
        view.camera.eye = *options.eye - origin;
    else
        view.camera = pictures::fittingCamera(direction, seen, options.width, options.height, options.angle);
    view.width = options.width, view.height = options.height, view.samples = options.samples;
    return view;
}

/// Corners of the boxes round frames.
std::vector<Vec3> cornersOf(std::span<const RunFrame> frames, const Vec3& origin)
{
    std::vector<Vec3> corners;
    for (const RunFrame& frame : frames)
        for (int k = 0; frame.bounds.size() == 2 && k < 8; ++k)
            corners.push_back(Vec3(frame.bounds[std::size_t(k & 1)].x(), frame.bounds[std::size_t(k >> 1 & 1)].y(),
                                   frame.bounds[std::size_t(k >> 2)].z()) -
                              origin);
    return corners;
}

/// Points [m] that the camera has to see.
std::vector<Vec3> seenPoints(const std::vector<pictures::Subject>& subjects, std::span<const RunFrame> frames,
                             PictureOptions::Fit fit, const Vec3& origin)
{
    if (fit == PictureOptions::Fit::first)
        if (std::vector<Vec3> corners = cornersOf(frames.first(1), origin); !corners.empty()) return corners;
    std::vector<Vec3> seen;
    if (fit == PictureOptions::Fit::run) seen = cornersOf(frames, origin);
    for (const pictures::Subject& s : subjects) seen.insert(seen.end(), s.points.begin(), s.points.end());
    return seen;
}

/// What flies or falls away makes all else small.
void noteSize(std::span<const RunFrame> run, std::span<const Vec3> seen, const PictureOptions& options,
              std::vector<std::string>& notes)
{
    constexpr double kMuch = 4;  // of the size in the run's first frame
    const auto sizeOf = [](std::span<const Vec3> points) {
        Eigen::AlignedBox3d box;
        for (const Vec3& p : points) box.extend(p);
        return box.isEmpty() ? 0 : box.sizes().maxCoeff();
    };
    const double first = sizeOf(cornersOf(run.first(1), Vec3::Zero())), all = sizeOf(seen);
    if (!options.eye && options.fit != PictureOptions::Fit::first && first > 0 && all > kMuch * first)
        notes.push_back("the pictures show a place " + shortNumber(all / first, 2) +
                        " times as large as what is in the first frame; --fit first shows that alone");
}

/// Of "#c0392b".
pictures::Colour colourOf(const std::string& text)
{
    unsigned rgb = 0;
    char rest = 0;
    if (text.size() != 7 || std::sscanf(text.c_str(), "#%6x%c", &rgb, &rest) != 1)
        throw InputError({"--torn", "'" + text + "' is no colour", "material, red, as_others or #rrggbb", ""});
    return pictures::colourOnScreen(rgb);
}

/// `notes` get what textures cannot be drawn.
pictures::Paint paintOf(const PictureOptions& options, const fs::path& mtl, std::vector<std::string>& notes)
{
    pictures::Paint paint;
    if (fs::exists(mtl)) {
        const std::string text = readText(mtl);
        paint.materials = tetmesh::diffuseColours(text);
        if (options.colour == "material") {
            pictures::ReadTextures read = pictures::readTextures(text, mtl.parent_path());
            paint.textures = std::move(read.textures), notes = std::move(read.notes);
        }
    }
    if (options.colour == "fragment") paint.by = pictures::ColourBy::fragment;
    paint.keepsOwnTorn = options.torn == "material";
    if (options.torn == "as_others")
        paint.torn.reset();
    else if (options.torn != "material" && options.torn != "red")
        paint.torn = colourOf(options.torn);
    return paint;
}

/// Colours of what values of points stand for.
struct ValueName {
    const char *name, *what;
    bool byRoot;     // and it peaks at single points
    bool fromFirst;  // colours begin at the lowest, not at 0
};
constexpr ValueName kValues[] = {{"energy", "energy [J/m^3]", true, false},
                                 {"margin", "margin", false, false},
                                 {"arrival", "arrival [s]", false, true}};

void colourByValues(Scenery& scenery, const std::vector<RunFrame>& frames, const std::string& name)
{
    const auto known =
        std::find_if(std::begin(kValues), std::end(kValues), [&](const ValueName& v) { return name == v.name; });
    if (known == std::end(kValues)) return;
    std::vector<std::vector<float>> values;
    pictures::Scale scale{0, 0, known->byRoot};
    double low = std::numeric_limits<double>::infinity();
    for (const RunFrame& frame : frames) {
        requireWhole(frame, frame.ply);
        auto all = frame.ply.empty() ? std::map<std::string, std::vector<float>>() : tetmesh::readPlyValues(frame.ply);
        if (!all.contains(name))
            throw InputError({"--colour",
                              "frame " + std::to_string(frame.frame) + " has no '" + name + "' of its points", "",
                              "simulate with output.ply = true and '" + name + "' in output.vdb"});
        values.push_back(std::move(all[name]));
        if (values.back().empty()) continue;
        low = std::min<double>(low, tetmesh::lowEndOf(values.back()));
        scale.high =
            std::max<double>(scale.high, known->byRoot ? tetmesh::highEndOf(values.back())
                                                       : *std::max_element(values.back().begin(), values.back().end()));
    }
    if (!(scale.high > 0)) scale.high = 1;
    if (known->fromFirst && low < scale.high) scale.low = low;
    for (std::size_t i = 0; i < values.size(); ++i) pictures::colourByValue(scenery.subjects[i], values[i], scale);
    scenery.scale = scale, scenery.scaleName = known->what;
}

/// Puts the colliders of the run's scene into the pictures of its frames, and a floor under all that is in any frame of
/// the run, so that it does not depend on which are drawn.
void addColliders(Scenery& scenery, const RunFrames& run, const std::vector<RunFrame>& frames, const fs::path& folder,
                  const Vec3& origin)
{
    const scene::Scene scene = scene::readScene(folder / "scene.toml", lab::study::vocabulary());
    const DrawnColliders colliders(scene);
    double lowest = std::numeric_limits<double>::infinity();
    for (const Vec3& p : cornersOf(run.frames, origin)) lowest = std::min(lowest, p.y());
    for (const pictures::Subject& s : scenery.subjects)
        for (const Vec3& p : s.points) lowest = std::min(lowest, p.y());
    std::vector<double> times;
    for (const RunFrame& frame : run.frames) times.push_back((frame.frame - scene.time.firstFrame) / scene.time.fps);
    if (const auto ofColliders = colliders.lowest(times)) lowest = std::min(lowest, *ofColliders - origin.y());
    scenery.view.ground = colliders.floor() ? *colliders.floor() - origin.y() : lowest;
    for (std::size_t i = 0; i < frames.size(); ++i)
        colliders.addTo(scenery.subjects[i], (frames[i].frame - scene.time.firstFrame) / scene.time.fps, origin);
}

}  // namespace

RunFrames readDrawnRun(const fs::path& folder)
{
    RunFrames run = readRunFrames(folder);
    std::erase_if(run.frames, [](const RunFrame& f) { return f.obj.empty(); });
    if (run.frames.empty())
        throw InputError(
            {folder.string(), "holds no .obj frames to make pictures of", "", "simulate with output.obj = true"});
    return run;
}

std::vector<RunFrame> spread(const std::vector<RunFrame>& frames, int count)
{
    std::vector<RunFrame> chosen;
    const std::size_t n = std::min(std::size_t(count), frames.size()), last = frames.size() - 1;
    for (std::size_t i = 0; i < n; ++i)
        chosen.push_back(frames[n == 1 ? last : std::size_t(std::lround(double(i * last) / double(n - 1)))]);
    return chosen;
}

Scenery sceneryOf(const fs::path& folder, const RunFrames& run, const std::vector<RunFrame>& frames,
                  const PictureOptions& options)
{
    Scenery scenery;
    const pictures::Paint paint = paintOf(options, folder / "obj" / (run.scene + ".mtl"), scenery.notes);
    std::optional<Vec3> origin;  // pictures are made near the origin, wherever the body is
    for (const RunFrame& frame : frames) {
        requireWhole(frame, frame.obj);
        tetmesh::DrawnTopology drawn = tetmesh::readDrawnObj(frame.obj);
        if (!origin && !drawn.mesh.points.empty()) origin = drawn.mesh.points[0];
        for (Vec3& p : drawn.mesh.points) p -= *origin;
        scenery.subjects.push_back(pictures::subjectOf(drawn, drawn.mesh.points, paint));
    }
    colourByValues(scenery, frames, options.colour);
    const Vec3 from = origin.value_or(Vec3::Zero());
    const std::vector<Vec3> seen = seenPoints(scenery.subjects, run.frames, options.fit, from);
    noteSize(run.frames, seen, options, scenery.notes);
    scenery.view = viewOf(seen, options, from);
    scenery.seen = scenery.subjects.back().points;
    addColliders(scenery, run, frames, folder, from);
    std::vector<Vec3> lit = seen;
    for (const pictures::Subject& s : scenery.subjects) lit.insert(lit.end(), s.points.begin(), s.points.end());
    scenery.view.stage.emplace(lit);
    return scenery;
}

pictures::Image pictureOf(const Scenery& scenery, std::size_t frame, const pictures::View& view)
{
    pictures::Image image = pictures::render(scenery.subjects[frame], view);
    if (scenery.scale) pictures::drawLegend(image, *scenery.scale, scenery.scaleName);
    return image;
}

pictures::Image sheetOf(const fs::path& folder, int count)
{
    constexpr int kPixels = 240, kSamples = 8, kGap = 4;
    const RunFrames run = readDrawnRun(folder);
    const std::vector<RunFrame> frames = spread(run.frames, count);
    const Scenery scenery = sceneryOf(folder, run, frames, {.width = kPixels, .height = kPixels, .samples = kSamples});
    std::vector<pictures::Image> images;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        images.push_back(pictureOf(scenery, i, scenery.view));
        if (count > 1) pictures::drawLabel(images.back(), std::to_string(frames[i].frame));
    }
    return count == 1 ? images[0] : pictures::contactSheet(images, 4, kGap);
}

}  // namespace vdbfrac::cli
