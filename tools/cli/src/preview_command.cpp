// vdbfrac preview: pictures of a run, and a contact sheet of them.
#include "drawn_colliders.h"
#include "options.h"
#include "run_frames.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/cli/commands.h>
#include <vdbfrac/lab/study/study_table.h>
#include <vdbfrac/pictures/png_file.h>
#include <vdbfrac/pictures/render.h>
#include <vdbfrac/scene/reader.h>
#include <vdbfrac/tetmesh/obj_file.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

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

/// The run, with those of its frames that have an .obj.
RunFrames readRun(const fs::path& folder)
{
    RunFrames run = readRunFrames(folder);
    std::erase_if(run.frames, [](const RunFrame& f) { return f.obj.empty(); });
    if (run.frames.empty())
        throw InputError(
            {folder.string(), "holds no .obj frames to make pictures of", "", "simulate with output.obj = true"});
    return run;
}

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
    if (!chosen.empty()) return chosen;
    const int n = std::min<int>(options.count, int(run.frames.size()));
    for (int i = 0; i < n; ++i)
        chosen.push_back(
            run.frames[n == 1 ? run.frames.size() - 1
                              : std::size_t(std::lround(double(i) * double(run.frames.size() - 1) / (n - 1)))]);
    return chosen;
}

/// What all pictures have in common: a camera that sees all frames, and a floor under them.
pictures::View viewOf(const std::vector<pictures::Subject>& subjects, const PreviewOptions& options)
{
    const Vec3 direction(options.direction[0], options.direction[1], options.direction[2]);
    if (!(direction.norm() > 0))
        throw InputError({"--direction", "0 0 0 has no direction", "a vector with a length above 0", ""});
    std::vector<Vec3> points;
    for (const pictures::Subject& s : subjects) points.insert(points.end(), s.points.begin(), s.points.end());
    pictures::View view;
    view.camera = pictures::fittingCamera(direction, points, options.width, options.height);
    view.width = options.width, view.height = options.height, view.samples = options.samples;
    for (const Vec3& p : points) view.ground = std::min(p.y(), view.ground.value_or(p.y()));
    return view;
}

/// Puts the colliders of the run's scene into the pictures of its frames.
void addColliders(std::vector<pictures::Subject>& subjects, pictures::View& view, const std::vector<RunFrame>& frames,
                  const fs::path& folder, const Vec3& origin)
{
    const scene::Scene scene = scene::readScene(folder / "scene.toml", lab::study::vocabulary());
    const DrawnColliders colliders(scene);
    if (colliders.floor()) view.ground = *colliders.floor() - origin.y();
    for (std::size_t i = 0; i < subjects.size(); ++i)
        colliders.addTo(subjects[i], (frames[i].frame - scene.time.firstFrame) / scene.time.fps, origin);
}

/// Pictures of one frame from all round what is `seen` in it.
int turn(const pictures::Subject& subject, std::span<const Vec3> seen, pictures::View view,
         const PreviewOptions& options)
{
    const Vec3 direction(options.direction[0], options.direction[1], options.direction[2]);
    std::vector<pictures::Image> images;
    for (int i = 0; i < options.turntable; ++i) {
        const double angle = 2 * std::acos(-1.) * i / options.turntable, c = std::cos(angle), s = std::sin(angle);
        const Vec3 turned(c * direction.x() + s * direction.z(), direction.y(), c * direction.z() - s * direction.x());
        view.camera = pictures::fittingCamera(turned, seen, options.width, options.height);
        images.push_back(pictures::render(subject, view));
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
    const RunFrames run = readRun(folder);
    const auto frames = chosenFrames(run, options);
    const auto by = options.colour == "fragment" ? pictures::ColourBy::fragment : pictures::ColourBy::material;
    std::vector<pictures::Subject> subjects;
    const fs::path mtl = folder / "obj" / (run.scene + ".mtl");
    const auto materials = fs::exists(mtl) ? tetmesh::diffuseColours(readText(mtl)) : pictures::MaterialColours{};
    std::optional<Vec3> origin;  // pictures are made near the origin, wherever the body is
    for (const RunFrame& frame : frames) {
        tetmesh::DrawnTopology drawn = tetmesh::readDrawnObj(frame.obj);
        if (!origin && !drawn.mesh.points.empty()) origin = drawn.mesh.points[0];
        for (Vec3& p : drawn.mesh.points) p -= *origin;
        subjects.push_back(pictures::subjectOf(drawn, drawn.mesh.points, materials, by));
    }
    pictures::View view = viewOf(subjects, options);
    const std::vector<Vec3> seen = subjects.back().points;
    addColliders(subjects, view, frames, folder, origin.value_or(Vec3::Zero()));
    fs::create_directories(folder / "preview");
    if (options.turntable > 0) return turn(subjects.back(), seen, view, options);
    std::vector<pictures::Image> images;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        images.push_back(pictures::render(subjects[i], view));
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
