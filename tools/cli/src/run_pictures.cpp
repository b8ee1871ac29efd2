#include "run_pictures.h"

#include "drawn_colliders.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/lab/study/study_table.h>
#include <vdbfrac/pictures/png_file.h>
#include <vdbfrac/scene/reader.h>
#include <vdbfrac/tetmesh/obj_file.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace vdbfrac::cli {

namespace fs = std::filesystem;

namespace {

/// What all pictures have in common: a camera that sees all frames, and a floor under them.
pictures::View viewOf(const std::vector<pictures::Subject>& subjects, const PictureOptions& options)
{
    if (!(options.direction.norm() > 0))
        throw InputError({"--direction", "0 0 0 has no direction", "a vector with a length above 0", ""});
    std::vector<Vec3> points;
    for (const pictures::Subject& s : subjects) points.insert(points.end(), s.points.begin(), s.points.end());
    pictures::View view;
    view.camera = pictures::fittingCamera(options.direction, points, options.width, options.height);
    view.width = options.width, view.height = options.height, view.samples = options.samples;
    for (const Vec3& p : points) view.ground = std::min(p.y(), view.ground.value_or(p.y()));
    return view;
}

/// Puts the colliders of the run's scene into the pictures of its frames.
void addColliders(Scenery& scenery, const std::vector<RunFrame>& frames, const fs::path& folder, const Vec3& origin)
{
    const scene::Scene scene = scene::readScene(folder / "scene.toml", lab::study::vocabulary());
    const DrawnColliders colliders(scene);
    if (colliders.floor()) scenery.view.ground = *colliders.floor() - origin.y();
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
    const fs::path mtl = folder / "obj" / (run.scene + ".mtl");
    const auto materials = fs::exists(mtl) ? tetmesh::diffuseColours(readText(mtl)) : pictures::MaterialColours{};
    std::optional<Vec3> origin;  // pictures are made near the origin, wherever the body is
    for (const RunFrame& frame : frames) {
        tetmesh::DrawnTopology drawn = tetmesh::readDrawnObj(frame.obj);
        if (!origin && !drawn.mesh.points.empty()) origin = drawn.mesh.points[0];
        for (Vec3& p : drawn.mesh.points) p -= *origin;
        scenery.subjects.push_back(pictures::subjectOf(drawn, drawn.mesh.points, materials, options.colour));
    }
    scenery.view = viewOf(scenery.subjects, options);
    scenery.seen = scenery.subjects.back().points;
    addColliders(scenery, frames, folder, origin.value_or(Vec3::Zero()));
    return scenery;
}

fs::path writeSheet(const fs::path& folder, int count, const std::string& file)
{
    constexpr int kPixels = 240, kSamples = 8, kGap = 4;
    const RunFrames run = readDrawnRun(folder);
    const Scenery scenery =
        sceneryOf(folder, run, spread(run.frames, count), {.width = kPixels, .height = kPixels, .samples = kSamples});
    std::vector<pictures::Image> images;
    for (const pictures::Subject& s : scenery.subjects) images.push_back(pictures::render(s, scenery.view));
    fs::create_directories(folder / "preview");
    const fs::path sheet = folder / "preview" / file;
    pictures::writePng(sheet, count == 1 ? images[0] : pictures::contactSheet(images, 4, kGap));
    return sheet;
}

}  // namespace vdbfrac::cli
