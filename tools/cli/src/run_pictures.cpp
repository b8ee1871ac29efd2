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
    const Vec3 direction =
        options.eye && options.target ? Vec3(*options.target - *options.eye) : options.direction.value_or(kDirection);
    if (!(direction.norm() > 0))
        throw InputError({options.eye ? "--look-at" : "--direction", "there is no direction to look in", "",
                          options.eye ? "a point other than that of --eye" : "a vector with a length above 0"});
    return direction;
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

/// What flies or falls away makes all else small.
void noteSize(std::span<const RunFrame> run, const Eigen::AlignedBox3d& seen, const PictureOptions& options,
              std::vector<std::string>& notes)
{
    constexpr double kMuch = 4;  // of the size in the run's first frame
    Eigen::AlignedBox3d box;
    for (const Vec3& p : cornersOf(run.first(1), Vec3::Zero())) box.extend(p);
    const double first = box.isEmpty() ? 0 : box.sizes().maxCoeff(), all = seen.isEmpty() ? 0 : seen.sizes().maxCoeff();
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

const ValueName* valueNamed(const std::string& name)
{
    const auto known =
        std::find_if(std::begin(kValues), std::end(kValues), [&](const ValueName& v) { return name == v.name; });
    return known == std::end(kValues) ? nullptr : known;
}

/// Of the points of a frame.
std::vector<float> valuesIn(const RunFrame& frame, const std::string& name)
{
    requireWhole(frame, frame.ply);
    auto all = frame.ply.empty() ? std::map<std::string, std::vector<float>>() : tetmesh::readPlyValues(frame.ply);
    if (!all.contains(name))
        throw InputError({"--colour", "frame " + std::to_string(frame.frame) + " has no '" + name + "' of its points",
                          "", "simulate with output.ply = true and '" + name + "' in output.vdb"});
    return std::move(all[name]);
}

/// The same colours in all frames.
pictures::Scale scaleOf(const std::vector<RunFrame>& frames, const ValueName& of)
{
    pictures::Scale scale{0, 0, of.byRoot};
    double low = std::numeric_limits<double>::infinity();
    for (const RunFrame& frame : frames) {
        const std::vector<float> values = valuesIn(frame, of.name);
        if (values.empty()) continue;
        low = std::min<double>(low, tetmesh::lowEndOf(values));
        scale.high = std::max<double>(
            scale.high, of.byRoot ? tetmesh::highEndOf(values) : *std::max_element(values.begin(), values.end()));
    }
    if (!(scale.high > 0)) scale.high = 1;
    if (of.fromFirst && low < scale.high) scale.low = low;
    return scale;
}

/// Looks through all frames once: what the camera sees, and what is lit.
class Survey {
public:
    Survey(const RunFrames& run, const PictureOptions& options, const Vec3& origin)
        : camera_(directionOf(options), options.width, options.height, options.angle)
    {
        using Fit = PictureOptions::Fit;
        const std::vector<RunFrame>& all = run.frames;
        if (options.fit == Fit::first) see(cornersOf(std::span(all).first(1), origin));
        if (options.fit == Fit::run) see(cornersOf(all, origin));
        seesFrames_ = options.fit != Fit::first || seen_.isEmpty();
        for (const Vec3& p : cornersOf(all, origin)) lowest_ = std::min(lowest_, p.y());
    }
    void addBodies(std::span<const Vec3> points)
    {
        if (seesFrames_) see(points);
        for (const Vec3& p : points) lowest_ = std::min(lowest_, p.y());
    }
    void addLit(std::span<const Vec3> points)
    {
        if (!stage_ && !points.empty()) stage_.emplace(points);
        if (stage_) stage_->add(points);
    }

    pictures::Camera camera() const { return camera_.camera(); }
    const Eigen::AlignedBox3d& seen() const { return seen_; }
    const std::optional<pictures::Stage>& stage() const { return stage_; }
    double lowest() const { return lowest_; }  ///< m: of all bodies

private:
    void see(std::span<const Vec3> points)
    {
        camera_.add(points), addLit(points);
        for (const Vec3& p : points) seen_.extend(p);
    }

    pictures::CameraFit camera_;
    std::optional<pictures::Stage> stage_;
    Eigen::AlignedBox3d seen_;
    bool seesFrames_ = true;
    double lowest_ = std::numeric_limits<double>::infinity();
};

}  // namespace

struct Surroundings {
    scene::Scene scene;
    DrawnColliders colliders;

    explicit Surroundings(const fs::path& file)
        : scene(scene::readScene(file, lab::study::vocabulary())), colliders(scene)
    {
    }
    double timeOf(const RunFrame& frame) const { return (frame.frame - scene.time.firstFrame) / scene.time.fps; }
    /// Height [m] of a floor under all that is in any frame of the run, so that it does not depend on which are drawn.
    double ground(const RunFrames& run, double lowest, const Vec3& origin) const
    {
        std::vector<double> times;
        for (const RunFrame& frame : run.frames) times.push_back(timeOf(frame));
        if (const auto ofColliders = colliders.lowest(times)) lowest = std::min(lowest, *ofColliders - origin.y());
        return colliders.floor() ? *colliders.floor() - origin.y() : lowest;
    }
};

RunFrames readDrawnRun(const fs::path& folder)
{
    RunFrames run = report::readRunFrames(folder);
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

namespace {

void addColliders(const Scenery& scenery, std::size_t frame, pictures::Subject& subject)
{
    const Surroundings& s = *scenery.surroundings;
    s.colliders.addTo(subject, s.timeOf(scenery.frames[frame]), scenery.origin);
}

}  // namespace

pictures::Subject bodiesIn(const Scenery& scenery, std::size_t frame)
{
    const RunFrame& of = scenery.frames[frame];
    requireWhole(of, of.obj);
    tetmesh::DrawnTopology drawn = tetmesh::readDrawnObj(of.obj);
    for (Vec3& p : drawn.mesh.points) p -= scenery.origin;
    return pictures::subjectOf(drawn, drawn.mesh.points, scenery.paint);
}

pictures::Subject subjectOf(const Scenery& scenery, std::size_t frame)
{
    pictures::Subject subject = bodiesIn(scenery, frame);
    if (!scenery.values.empty())
        pictures::colourByValue(subject, valuesIn(scenery.frames[frame], scenery.values), scenery.scale);
    addColliders(scenery, frame, subject);
    return subject;
}

Scenery sceneryOf(const fs::path& folder, const RunFrames& run, const std::vector<RunFrame>& frames,
                  const PictureOptions& options)
{
    Scenery scenery;
    scenery.frames = frames;
    scenery.paint = paintOf(options, folder / "obj" / (run.scene + ".mtl"), scenery.notes);
    if (const ValueName* of = valueNamed(options.colour))
        scenery.values = of->name, scenery.scale = scaleOf(frames, *of);
    scenery.surroundings = std::make_shared<Surroundings>(folder / "scene.toml");
    for (std::size_t i = 0; i < frames.size() && scenery.origin.isZero(); ++i)
        if (const std::vector<Vec3> points = bodiesIn(scenery, i).points; !points.empty()) scenery.origin = points[0];
    Survey survey(run, options, scenery.origin);
    for (std::size_t i = 0; i < frames.size(); ++i) {
        pictures::Subject subject = bodiesIn(scenery, i);
        survey.addBodies(subject.points);
        addColliders(scenery, i, subject);
        survey.addLit(subject.points);
    }
    noteSize(run.frames, survey.seen(), options, scenery.notes);
    scenery.view.width = options.width, scenery.view.height = options.height, scenery.view.samples = options.samples;
    pictures::Camera& camera = scenery.view.camera = survey.camera();
    if (options.eye) camera.eye = *options.eye - scenery.origin;
    const Vec3 toMiddle = survey.seen().center() - camera.eye;
    if (options.eye && !options.target && !options.direction && toMiddle.norm() > 0) camera.direction = toMiddle;
    scenery.view.stage = survey.stage();
    scenery.view.ground = scenery.surroundings->ground(run, survey.lowest(), scenery.origin);
    return scenery;
}

pictures::Image pictureOf(const Scenery& scenery, const pictures::Subject& subject, const pictures::View& view)
{
    pictures::Image image = pictures::render(subject, view);
    if (const ValueName* of = valueNamed(scenery.values)) pictures::drawLegend(image, scenery.scale, of->what);
    return image;
}

pictures::Image tileOf(const pictures::Image& picture, const std::string& label)
{
    constexpr int kWidest = 480;  // pixels: sheets of large pictures would be larger than any screen
    pictures::Image tile = pictures::reduced(picture, (picture.width + kWidest - 1) / kWidest);
    if (!label.empty()) pictures::drawLabel(tile, label);
    return tile;
}

pictures::Image sheetOf(const fs::path& folder, int count)
{
    constexpr int kPixels = 240, kSamples = 8, kGap = 4;
    const RunFrames run = readDrawnRun(folder);
    const std::vector<RunFrame> frames = spread(run.frames, count);
    const Scenery scenery = sceneryOf(folder, run, frames, {.width = kPixels, .height = kPixels, .samples = kSamples});
    std::vector<pictures::Image> images;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const std::string label = count > 1 ? std::to_string(frames[i].frame) : "";
        images.push_back(tileOf(pictureOf(scenery, subjectOf(scenery, i), scenery.view), label));
    }
    return count == 1 ? images[0] : pictures::contactSheet(images, 4, kGap);
}

}  // namespace vdbfrac::cli
