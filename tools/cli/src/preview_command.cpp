// vdbfrac preview: pictures of a run, and a contact sheet of them.
#include "number_options.h"
#include "options.h"
#include "run_pictures.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/cli/commands.h>
#include <vdbfrac/cli/frame_list.h>
#include <vdbfrac/pictures/png_file.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>

namespace vdbfrac::cli {

namespace fs = std::filesystem;

namespace {

const std::map<std::string, PictureOptions::Fit> kFits = {
    {"frames", PictureOptions::Fit::frames}, {"run", PictureOptions::Fit::run}, {"first", PictureOptions::Fit::first}};

struct PreviewOptions {
    std::string folder, frames, output;
    int count = 12, columns = 4, width = 480, height = 480, samples = 32;
    int turntable = 0;
    std::string colour = "material", torn = "material", fit = "frames";
    std::vector<double> direction, eye, lookAt;
    double angle = 45;  // degrees
    bool quiet = false;
    int threads = 0;  // 0: all cores

    fs::path pictures() const { return output.empty() ? fs::path(folder) / "preview" : fs::path(output); }
    void say(const fs::path& file) const
    {
        if (!quiet) std::printf("%s\n", file.c_str());
    }
};

constexpr double kFarthest = 1e9;  // m: rays are floats, and squares of their lengths

Vec3 pointOf(const std::vector<double>& p) { return {p[0], p[1], p[2]}; }

/// The frames asked for, or `count` of them spread over the run with the first and the last.
std::vector<RunFrame> chosenFrames(const RunFrames& run, const PreviewOptions& options)
{
    std::vector<RunFrame> chosen;
    for (int wanted : options.frames.empty() ? std::vector<int>() : parseFrames(options.frames)) {
        const auto it =
            std::find_if(run.frames.begin(), run.frames.end(), [&](const auto& f) { return f.frame == wanted; });
        if (it == run.frames.end())
            throw InputError(
                {options.folder, "has no frame " + std::to_string(wanted),
                 std::to_string(run.frames.front().frame) + " to " + std::to_string(run.frames.back().frame), ""});
        chosen.push_back(*it);
    }
    return chosen.empty() ? spread(run.frames, options.count) : chosen;
}

/// Points on the rims of the upright cylinder round some points: cameras all round see it alike.
std::vector<Vec3> turnedRound(const std::vector<Vec3>& points, int angles)
{
    if (points.empty()) return points;
    Vec3 low = points[0], high = points[0];
    for (const Vec3& p : points) low = low.cwiseMin(p), high = high.cwiseMax(p);
    const Vec3 middle = .5 * (low + high);
    double radius = 0;
    for (const Vec3& p : points) radius = std::max(radius, std::hypot(p.x() - middle.x(), p.z() - middle.z()));
    std::vector<Vec3> round;
    for (int i = 0; i < angles; ++i) {
        const double angle = 2 * std::acos(-1.) * i / angles;
        for (const double y : {low.y(), high.y()})
            round.emplace_back(middle.x() + radius * std::cos(angle), y, middle.z() + radius * std::sin(angle));
    }
    return round;
}

fs::path turnFile(const fs::path& folder, const std::string& scene, int number)
{
    return folder / fmt::format("{}.turn.{:04}.png", scene, number);
}

int writeSheet(const std::vector<pictures::Image>& images, const PreviewOptions& options)
{
    const fs::path sheet = options.pictures() / "contact_sheet.png";
    pictures::writePng(sheet, pictures::contactSheet(images, options.columns, 4));
    options.say(sheet);
    return kDone;
}

/// Pictures of the last frame from all round what is seen in it. In the run's own folder those of a turn of more
/// pictures go.
int turn(const Scenery& scenery, const std::string& scene, const PreviewOptions& options)
{
    constexpr int kRound = 64;
    const Vec3 direction = options.direction.empty() ? kDirection : pointOf(options.direction);
    const std::size_t last = scenery.frames.size() - 1;
    const pictures::Subject subject = subjectOf(scenery, last);
    const std::vector<Vec3> seen = turnedRound(bodiesIn(scenery, last).points, kRound);
    pictures::View view = scenery.view;
    std::vector<pictures::Image> tiles;
    for (int i = 0; i < options.turntable; ++i) {
        const double angle = 2 * std::acos(-1.) * i / options.turntable, c = std::cos(angle), s = std::sin(angle);
        const Vec3 turned(c * direction.x() + s * direction.z(), direction.y(), c * direction.z() - s * direction.x());
        view.camera = pictures::fittingCamera(turned, seen, options.width, options.height, options.angle);
        const pictures::Image picture = pictureOf(scenery, subject, view);
        const fs::path file = turnFile(options.pictures(), scene, i + 1);
        pictures::writePng(file, picture);
        tiles.push_back(tileOf(picture, ""));
        options.say(file);
    }
    if (options.output.empty())
        for (int i = options.turntable + 1; fs::remove(turnFile(options.pictures(), scene, i)); ++i) {}
    return writeSheet(tiles, options);
}

int preview(const PreviewOptions& options)
{
    const fs::path folder = options.folder;
    const RunFrames run = readDrawnRun(folder);
    const auto frames = chosenFrames(run, options);
    PictureOptions how{.width = options.width, .height = options.height, .samples = options.samples};
    how.angle = options.angle;
    if (!options.direction.empty()) how.direction = pointOf(options.direction);
    how.colour = options.colour, how.torn = options.torn, how.fit = kFits.at(options.fit);
    if (!options.eye.empty()) how.eye = pointOf(options.eye);
    if (!options.lookAt.empty()) how.target = pointOf(options.lookAt);
    const Scenery scenery = sceneryOf(folder, run, frames, how);
    for (const std::string& note : options.quiet ? std::vector<std::string>() : scenery.notes)
        std::fprintf(stderr, "note: %s\n", note.c_str());
    fs::create_directories(options.pictures());
    if (options.turntable > 0) return turn(scenery, run.scene, options);
    std::vector<pictures::Image> tiles;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const pictures::Image picture = pictureOf(scenery, subjectOf(scenery, i), scenery.view);
        const fs::path file = options.pictures() / fmt::format("{}.{:04}.png", run.scene, frames[i].frame);
        pictures::writePng(file, picture);
        tiles.push_back(tileOf(picture, std::to_string(frames[i].frame)));
        options.say(file);
    }
    return writeSheet(tiles, options);
}

}  // namespace

Action addPreview(CLI::App& app)
{
    auto o = std::make_shared<PreviewOptions>();
    CLI::App* c = app.add_subcommand("preview", "Render PNG pictures of a run and a contact sheet; torn faces are red");
    c->add_option("DIR", o->folder, "Folder that 'vdbfrac sim -o' wrote")->required();
    c->add_option("-o,--output", o->output,
                  "Folder of the pictures (default: DIR/preview); files already there are kept")
        ->type_name("OUT");
    c->add_option("-f,--frames", o->frames,
                  "Frames to render, as 1-96, 1-96x2 or 5,9,12 (default: some spread over the run)");
    c->add_option("--count", o->count, "How many frames to spread over the run")
        ->check(CLI::Range(1, 10000))
        ->capture_default_str();
    c->add_option("--columns", o->columns, "Columns of the contact sheet")
        ->check(CLI::Range(1, 100))
        ->capture_default_str();
    c->add_option("--width", o->width, "Pixels")->check(CLI::Range(16, 8192))->capture_default_str();
    c->add_option("--height", o->height, "Pixels")->check(CLI::Range(16, 8192))->capture_default_str();
    c->add_option("--samples", o->samples, "Rays a pixel")->check(CLI::Range(1, 64))->capture_default_str();
    c->add_option("--turntable", o->turntable, "Turntable of the last of the frames, with this many pictures")
        ->check(CLI::Range(1, 10000));
    c->add_option("--colour,--color", o->colour,
                  "What the surface is coloured by: material, fragment; or, with a legend, a value of points, of runs "
                  "with output.ply = true: energy, margin, arrival")
        ->check(CLI::IsMember({"material", "fragment", "energy", "margin", "arrival"}))
        ->capture_default_str();
    c->add_option("--torn", o->torn,
                  "Colour of torn faces: material (torn_colour of the body's material; red without one), red, "
                  "as_others, or #rrggbb")
        ->capture_default_str();
    auto* fit =
        c->add_option(
             "--fit", o->fit,
             "What the camera sees: all that is in the frames of the pictures, or of the run, or in its first frame")
            ->check(CLI::IsMember(kFits))
            ->capture_default_str();
    const Bounded place(kFarthest);
    c->add_option("--direction", o->direction, "Direction of looking: x y z")->expected(3)->check(place);
    auto* eye =
        c->add_option("--eye", o->eye,
                      "Where the camera is [m]: x y z; in place of --fit. Alone it looks at the middle of the frames")
            ->expected(3)
            ->check(place)
            ->excludes(fit);
    c->add_option("--look-at", o->lookAt, "A point that it looks at [m]: x y z; in place of --direction")
        ->expected(3)
        ->check(place)
        ->needs(eye);
    c->add_option("--angle", o->angle, "Field of view along the longer side of the picture [degrees]")
        ->check(CLI::Range(1., 170.))
        ->capture_default_str();
    c->add_flag("-q,--quiet", o->quiet, "Say only what went wrong");
    addThreads(*c, o->threads);
    return [o] {
        const ThreadLimit threads(o->threads);
        return preview(*o);
    };
}

}  // namespace vdbfrac::cli
