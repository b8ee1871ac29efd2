// vdbfrac embed: one topology over all frames of a run, for motion blur and for other render meshes.
#include "options.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/cli/commands.h>
#include <vdbfrac/cli/frame_list.h>
#include <vdbfrac/core/drawing.h>
#include <vdbfrac/core/point_cache.h>
#include <vdbfrac/core/run_folder.h>
#include <vdbfrac/core/version.h>
#include <vdbfrac/lab/scenes/prepared_scene.h>
#include <vdbfrac/lab/study/study_table.h>
#include <vdbfrac/report/record.h>
#include <vdbfrac/scene/reader.h>
#include <vdbfrac/tetmesh/cache_files.h>
#include <vdbfrac/tetmesh/render_mesh.h>
#include <vdbfrac/tetmesh/surface_input.h>

#include <algorithm>
#include <cstdio>
#include <utility>

namespace vdbfrac::cli {

namespace fs = std::filesystem;

namespace {

struct EmbedOptions {
    std::string folder, mesh, body, out;
    bool placed = false, quiet = false;
    int threads = 0;
    double maxMemory = 0;
};

/// The newest whole one of a run.
core::Archive newestCheckpoint(const fs::path& folder, std::uint64_t limit)
{
    std::vector<fs::path> checkpoints = core::checkpointsIn(folder);
    std::string passed;
    for (std::reverse(checkpoints.begin(), checkpoints.end()); const fs::path& file : checkpoints) {
        try {
            core::Archive archive = core::Archive::read(file, limit);
            if (const std::string creator = archive.getText("creator"); creator != core::kCreator)
                throw InputError({folder.string(), "was made by " + creator + ", this is " + core::kCreator, "",
                                  "simulate it again"});
            if (!passed.empty()) std::fprintf(stderr, "note: an older checkpoint is taken%s\n", passed.c_str());
            return archive;
        } catch (const FileError& e) {
            passed += std::string("; ") + e.what();
        }
    }
    throw FileError(folder.string(), "holds no whole checkpoint" + passed);
}

bool isOfFile(const scene::Body& body) { return !std::holds_alternative<Primitive>(body.shape); }

/// What of a mesh is likely a mistake, or is one.
void noteInput(const EmbedOptions& options, const tetmesh::SurfaceReport& report, const core::Body& body,
               const scene::Body& spec)
{
    // Sizes. Beyond the last ones it is another unit; most of what is so large lies far from the body, and would take
    // minutes.
    constexpr double kAlike = 2, kLeast = .1, kMost = 3;
    Vec3 lower = body.mesh->restPosition(0), upper = lower;
    for (const Vec3& X : tetmesh::restPositions(*body.mesh)) lower = lower.cwiseMin(X), upper = upper.cwiseMax(X);
    const bool mayMove = isOfFile(spec) && !options.placed;
    const std::string placed = mayMove ? "--placed moves it as the scene moves the body's own file" : "";
    const double times = (report.upper - report.lower).maxCoeff() / (upper - lower).maxCoeff();
    if ((report.lower.array() > upper.array()).any() || (report.upper.array() < lower.array()).any())
        throw InputError(
            {options.mesh, "lies beside body '" + body.name + "'", "a mesh where the body lies at rest", placed});
    if (!(times <= kMost && times >= kLeast))
        throw InputError({options.mesh,
                          "is " + shortNumber(times, 3) + " times as large as body '" + body.name + "' at rest",
                          "a tenth to three times", placed});
    if (!(times <= kAlike && times >= 1 / kAlike))
        std::fprintf(stderr, "note: %s is %.3g times as large as body '%s' at rest%s\n", options.mesh.c_str(), times,
                     body.name.c_str(),
                     mayMove ? "; should it be moved as the scene moves the body's own (--placed)?" : "");
    if (!report.closed)
        std::fprintf(stderr, "note: %s has %zu open edges, and what is made of it will be open there\n",
                     options.mesh.c_str(), report.openEdges);
}

/// Where the scene puts the file of a body.
scene::FilePlace placeOfFile(const scene::Body& body)
{
    if (const auto* mesh = std::get_if<scene::MeshFile>(&body.shape)) return scene::placeOf(*mesh);
    if (const auto* vdb = std::get_if<scene::VdbFile>(&body.shape)) return scene::placeOf(*vdb);
    throw InputError({"--placed", "body '" + body.name + "' is of no file that the scene moves", "", "leave it out"});
}

void notePlace(const EmbedOptions& options, const scene::Body& body)
{
    if (isOfFile(body) && !options.placed && placeOfFile(body).isMoved())
        std::fprintf(stderr,
                     "note: the scene moves the file of body '%s'; %s is taken to lie where that is moved to "
                     "(--placed moves it too)\n",
                     body.name.c_str(), options.mesh.c_str());
}

/// A run at its last checkpoint.
struct LastState {
    lab::PreparedScene prepared;
    core::Drawing drawing;
    bool isClosed = false;  // the mesh that is drawn instead of a body's own
    std::vector<fs::path> inputs;

    LastState(const fs::path& folder, const EmbedOptions& options, std::uint64_t limit)
        : prepared(scene::readScene(report::manifestIn(folder).parent_path() / "scene.toml", lab::study::vocabulary()),
                   limit),
          drawing(prepared.scene, prepared.simulation)
    {
        if (!prepared.scene.output.followsNodes())
            throw InputError(
                {folder.string(), "holds no positions of nodes", "", "simulate with output.motion = true"});
        inputs = core::inputsOf(prepared.scene);
        if (!options.mesh.empty()) replace(options);
        inputs.insert(inputs.end(), drawing.materialFiles().begin(), drawing.materialFiles().end());
        prepared.simulation.restoreFrom(newestCheckpoint(folder, limit));
        Ledger work;
        drawing.followWhole(prepared.simulation, work);
    }

private:
    void replace(const EmbedOptions& options)
    {
        const auto& bodies = prepared.scene.bodies;
        const auto named =
            std::find_if(bodies.begin(), bodies.end(), [&](const auto& b) { return b.name == options.body; });
        std::string names;
        for (const auto& b : bodies) names += (names.empty() ? "one of " : ", ") + b.name;
        if (!options.body.empty() && named == bodies.end())
            throw InputError({"--body", "there is no body '" + options.body + "'", names, ""});
        if (options.body.empty() && bodies.size() > 1)
            throw InputError({"--body", "is missing: the run has several bodies", names, ""});
        const std::size_t b = options.body.empty() ? 0 : std::size_t(named - bodies.begin());
        tetmesh::RenderMesh mesh = tetmesh::readRenderMesh(options.mesh);
        inputs.push_back(options.mesh);
        notePlace(options, bodies[b]);
        if (options.placed) core::moveMesh(mesh, placeOfFile(bodies[b]));
        const tetmesh::SurfaceReport report = tetmesh::examine(tetmesh::soupOf(mesh));
        isClosed = report.closed;
        noteInput(options, report, prepared.simulation.bodies()[b], bodies[b]);
        drawing.replace(prepared.scene, prepared.simulation, b, std::move(mesh), fs::path(options.mesh).parent_path());
    }
};

/// Files of the frames up to the last that is done. run.json may not list all of them yet, if the run was killed.
std::vector<fs::path> motionFiles(const lab::PreparedScene& last, const fs::path& folder)
{
    std::vector<fs::path> files;
    for (int frame = 0; frame <= last.simulation.framesDone(); ++frame) {
        // The names of the folder and the scene may hold signs that stand for frames elsewhere.
        files.push_back(folder / "motion" /
                        (last.scene.name + frameName(".####.motion", last.scene.time.firstFrame + frame)));
        if (!fs::exists(files.back())) throw FileError(files.back().string(), "is not there, but later frames are");
    }
    return files;
}

/// A file a frame.
void writePly(const core::PointCache& cache, const EmbedOptions& options, int firstFrame,
              const std::vector<fs::path>& inputs)
{
    const std::string& out = options.out;
    for (std::size_t f = 0; f < cache.frames(); ++f) {
        const fs::path file = frameName(out, firstFrame + int(f));
        requireApart({file}, inputs);
        makeFolderOf(file);
        const core::DrawnFrame drawn = cache.frame(f);
        tetmesh::writePlyFrame(file, core::plyBodies(drawn), tetmesh::PlyOrder::asGiven);
        if (!options.quiet) std::printf("%s\n", file.c_str());
    }
}

/// Torn faces end where the body's own surface is.
void noteOpenEdges(const std::string& mesh, const core::PointCache& cache)
{
    std::size_t open = 0;
    for (const core::DrawnBody& body : cache.frame(cache.frames() - 1)) {
        tetmesh::PolygonSoup soup = tetmesh::soupOf(body.topology->mesh);
        soup.points = body.points;  // at rest lips lie on each other
        open += tetmesh::examine(soup).openEdges;
    }
    if (open > 0)
        std::fprintf(stderr,
                     "note: %zu edges are open that were closed: there %s lies so far from the surface of its body, "
                     "a voxel or more, that torn faces do not meet it\n",
                     open, mesh.c_str());
}

int embed(const EmbedOptions& options)
{
    const fs::path folder = options.folder;
    const bool isFrames = fs::path(options.out).extension() == ".ply";
    if (!isFrames) (void)core::PointCache::filesOf(options.out);  // refuses what cannot be written, before all work
    if (isFrames && !isSequence(options.out))
        throw InputError({options.out, "is one name for all frames", "a place for the frame, as in name.####.ply", ""});
    const LastState last(folder, options, memoryLimitOf(options.maxMemory));
    const scene::Scene& scene = last.prepared.scene;
    const core::Simulation& simulation = last.prepared.simulation;
    const core::PointCache cache(scene, simulation, last.drawing, motionFiles(last.prepared, folder));
    if (last.isClosed) noteOpenEdges(options.mesh, cache);
    if (const std::string lacks = cache.lacks(); !lacks.empty() && !options.quiet)
        std::fprintf(stderr, "note: %s\n", lacks.c_str());
    if (isFrames) {
        writePly(cache, options, scene.time.firstFrame, last.inputs);
        return kDone;
    }
    requireApart(core::PointCache::filesOf(options.out), last.inputs);
    makeFolderOf(options.out);
    for (const fs::path& file : cache.write(options.out))
        if (!options.quiet) std::printf("%s\n", file.c_str());
    return kDone;
}

}  // namespace

Action addEmbed(CLI::App& app)
{
    auto o = std::make_shared<EmbedOptions>();
    CLI::App* c = app.add_subcommand("embed", "One topology over all frames of a run, also of another render mesh");
    c->add_option("RUN", o->folder, "Folder that 'vdbfrac sim -o' wrote, with output.motion = true")->required();
    CLI::Option* const mesh =
        c->add_option("MESH", o->mesh, "Render mesh to use instead of the body's own, placed like the body at rest");
    c->add_option("-o,--output", o->out,
                  ".obj, with the positions of its points in an .mdd beside it; .usda; or .ply with #### for the frame")
        ->required()
        ->type_name("FILE");
    c->add_option("--body", o->body, "Body that MESH belongs to, where there are several")->type_name("NAME");
    c->add_flag("--placed", o->placed, "Scale, turn and move MESH as the scene does the body's own file")->needs(mesh);
    addThreads(*c, o->threads);
    addMaxMemory(*c, o->maxMemory, "it");
    c->add_flag("-q,--quiet", o->quiet, "Say only what went wrong");
    return [o] {
        const ThreadLimit threads(o->threads);
        return embed(*o);
    };
}

}  // namespace vdbfrac::cli
