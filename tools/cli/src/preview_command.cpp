// vdbfrac preview: pictures of a run, and a contact sheet of them.
#include "options.h"
#include "run_pictures.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/cli/commands.h>
#include <vdbfrac/pictures/png_file.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace vdbfrac::cli {

namespace fs = std::filesystem;

namespace {

struct PreviewOptions {
    std::string folder;
    std::vector<int> frames;
    int count = 12, columns = 4, width = 480, height = 480, samples = 16;
    int turntable = 0;
    std::string colour = "material";
    std::vector<double> direction = {-0.55, -0.35, -1};
};

/// The frames asked for, or `count` of them spread over the run with the first and the last.
std::vector<RunFrame> chosenFrames(const RunFrames& run, const PreviewOptions& options)
{
    std::vector<RunFrame> chosen;
    for (int wanted : options.frames) {
        const auto it =
            std::find_if(run.frames.begin(), run.frames.end(), [&](const auto& f) { return f.frame == wanted; });
        if (it == run.frames.end())
            throw InputError({options.folder, "has no frame " + std::to_string(wanted), "", ""});
        chosen.push_back(*it);
    }
    return chosen.empty() ? spread(run.frames, options.count) : chosen;
}

/// Pictures of the last frame from all round what is seen in it.
int turn(const Scenery& scenery, const PreviewOptions& options)
{
    const Vec3 direction(options.direction[0], options.direction[1], options.direction[2]);
    pictures::View view = scenery.view;
    std::vector<pictures::Image> images;
    for (int i = 0; i < options.turntable; ++i) {
        const double angle = 2 * std::acos(-1.) * i / options.turntable, c = std::cos(angle), s = std::sin(angle);
        const Vec3 turned(c * direction.x() + s * direction.z(), direction.y(), c * direction.z() - s * direction.x());
        view.camera = pictures::fittingCamera(turned, scenery.seen, options.width, options.height);
        images.push_back(pictures::render(scenery.subjects.back(), view));
        const fs::path file = fs::path(options.folder) / "preview" / fmt::format("turn.{:04}.png", i + 1);
        pictures::writePng(file, images.back());
        std::printf("%s\n", file.c_str());
    }
    const fs::path sheet = fs::path(options.folder) / "preview" / "contact_sheet.png";
    pictures::writePng(sheet, pictures::contactSheet(images, options.columns, 4));
    std::printf("%s\n", sheet.c_str());
    return kDone;
}

int preview(const PreviewOptions& options)
{
    const fs::path folder = options.folder;
    const RunFrames run = readDrawnRun(folder);
    const auto frames = chosenFrames(run, options);
    const auto by = options.colour == "fragment" ? pictures::ColourBy::fragment : pictures::ColourBy::material;
    const Vec3 direction(options.direction[0], options.direction[1], options.direction[2]);
    const Scenery scenery =
        sceneryOf(folder, run, frames, {options.width, options.height, options.samples, direction, by});
    fs::create_directories(folder / "preview");
    if (options.turntable > 0) return turn(scenery, options);
    std::vector<pictures::Image> images;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        images.push_back(pictures::render(scenery.subjects[i], scenery.view));
        const fs::path file = folder / "preview" / fmt::format("{}.{:04}.png", run.scene, frames[i].frame);
        pictures::writePng(file, images.back());
        std::printf("%s\n", file.c_str());
    }
    const fs::path sheet = folder / "preview" / "contact_sheet.png";
    pictures::writePng(sheet, pictures::contactSheet(images, options.columns, 4));
    std::printf("%s\n", sheet.c_str());
    return kDone;
}

}  // namespace

Action addPreview(CLI::App& app)
{
    auto o = std::make_shared<PreviewOptions>();
    CLI::App* c = app.add_subcommand("preview", "Render PNG pictures of a run and a contact sheet; torn faces are red");
    c->add_option("DIR", o->folder, "Folder that 'vdbfrac sim -o' wrote")->required();
    c->add_option("-f,--frames", o->frames, "Frames to render (default: some spread over the run)")->delimiter(',');
    c->add_option("--count", o->count, "How many frames to spread over the run")
        ->check(CLI::Range(1, 10000))
        ->capture_default_str();
    c->add_option("--columns", o->columns, "Columns of the contact sheet")
        ->check(CLI::Range(1, 100))
        ->capture_default_str();
    c->add_option("--width", o->width, "Pixels")->check(CLI::Range(16, 8192))->capture_default_str();
    c->add_option("--height", o->height, "Pixels")->check(CLI::Range(16, 8192))->capture_default_str();
    c->add_option("--samples", o->samples, "Rays a pixel")->check(CLI::Range(1, 64))->capture_default_str();
    c->add_option("--turntable", o->turntable, "Pictures from all round, this many, of the last of the frames")
        ->check(CLI::Range(1, 10000));
    c->add_option("--colour", o->colour, "What the surface is coloured by; torn faces are red")
        ->check(CLI::IsMember({"material", "fragment"}))
        ->capture_default_str();
    c->add_option("--direction", o->direction, "Direction of looking: x y z")->expected(3);
    return [o] { return preview(*o); };
}

}  // namespace vdbfrac::cli
