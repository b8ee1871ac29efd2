// vdbfrac embed: one topology over all frames of a run, for motion blur and for other render meshes.
#include "options.h"
#include "run_frames.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/cli/commands.h>
#include <vdbfrac/cli/frame_list.h>
#include <vdbfrac/core/drawing.h>
#include <vdbfrac/core/run_folder.h>
#include <vdbfrac/lab/scenes/prepared_scene.h>
#include <vdbfrac/lab/study/study_table.h>
#include <vdbfrac/scene/reader.h>
#include <vdbfrac/tetmesh/cache_files.h>
#include <vdbfrac/tetmesh/mtl_file.h>
#include <vdbfrac/tetmesh/obj_file.h>

#include <algorithm>
#include <cstdio>
#include <numeric>

namespace vdbfrac::cli {

namespace fs = std::filesystem;

namespace {

struct EmbedOptions {
    std::string folder, mesh, body, out;
    int threads = 0;
    double maxMemory = 0;
};

/// The frames of a run as they are on the nodes of its last: each of these has one ancestor in every frame before.
class Motion {
public:
    Motion(std::vector<fs::path> files, std::size_t bodies, std::span<const std::size_t> lastNodes)
        : files_(std::move(files)), node_(files_.size())
    {
        std::vector<std::vector<std::uint32_t>> node(bodies);
        for (std::size_t b = 0; b < bodies; ++b) {
            node[b].resize(lastNodes[b]);
            std::iota(node[b].begin(), node[b].end(), 0u);
        }
        for (std::size_t f = files_.size(); f-- > 0;) {
            node_[f] = node;
            const core::Archive archive = core::Archive::read(files_[f]);
            for (std::size_t b = 0; b < bodies; ++b) {
                const auto before = archive.get<std::uint32_t>("before_" + std::to_string(b));
                if (before.empty()) continue;
                for (std::uint32_t& n : node[b]) n = before[n];
            }
        }
    }

    std::size_t frames() const { return files_.size(); }
    /// Positions and velocities of the last frame's nodes of a body in a frame.
    struct State {
        std::vector<Vec3> x, v;
    };
    std::vector<State> states(std::size_t frame) const
    {
        const core::Archive archive = core::Archive::read(files_[frame]);
        std::vector<State> bodies;
        for (std::size_t b = 0; b < node_[frame].size(); ++b) bodies.push_back(state(archive, frame, b));
        return bodies;
    }

private:
    State state(const core::Archive& archive, std::size_t frame, std::size_t body) const
    {
        const auto x = archive.get<Vec3>("x_" + std::to_string(body)),
                   v = archive.get<Vec3>("v_" + std::to_string(body));
        State state;
        for (std::uint32_t n : node_[frame][body]) {
            if (n >= x.size() || n >= v.size()) archive.complain("has too few nodes for the run's last frame");
            state.x.push_back(x[n]), state.v.push_back(v[n]);
        }
        return state;
    }

    std::vector<fs::path> files_;
    std::vector<std::vector<std::vector<std::uint32_t>>> node_;  // of each frame and body
};

/// A run at its last checkpoint.
struct LastState {
    lab::PreparedScene prepared;
    core::Drawing drawing;

    LastState(const fs::path& folder, const EmbedOptions& options, std::uint64_t limit)
        : prepared(scene::readScene(folder / "scene.toml", lab::study::vocabulary()), limit),
          drawing(prepared.scene, prepared.simulation)
    {
        if (!prepared.scene.output.motion)
            throw InputError(
                {folder.string(), "holds no positions of nodes", "", "simulate with output.motion = true"});
        if (!options.mesh.empty()) replace(options);
        const std::vector<fs::path> checkpoints = core::checkpointsIn(folder);
        if (checkpoints.empty()) throw FileError(folder.string(), "holds no checkpoint");
        prepared.simulation.restoreFrom(core::Archive::read(checkpoints.back(), limit));
        Ledger work;
        drawing.follow(prepared.simulation, work);
    }

private:
    void replace(const EmbedOptions& options)
    {
        const auto& bodies = prepared.scene.bodies;
        const auto named =
            std::find_if(bodies.begin(), bodies.end(), [&](const auto& b) { return b.name == options.body; });
        if (!options.body.empty() && named == bodies.end())
            throw InputError({"--body", "there is no body '" + options.body + "'", "", ""});
        if (options.body.empty() && bodies.size() > 1)
            throw InputError({"--body", "the run has several bodies", "the name of the one that the mesh is for", ""});
        const std::size_t b = options.body.empty() ? 0 : std::size_t(named - bodies.begin());
        drawing.replace(prepared.scene, prepared.simulation, b, tetmesh::readRenderMesh(options.mesh));
    }
};

/// Files of the frames up to the last that is done.
std::vector<fs::path> motionFiles(const RunFrames& run, const core::Simulation& simulation, const fs::path& folder)
{
    std::vector<fs::path> files;
    for (const RunFrame& frame : run.frames)
        if (!frame.motion.empty() && int(files.size()) <= simulation.framesDone()) files.push_back(frame.motion);
    if (int(files.size()) != simulation.framesDone() + 1)
        throw FileError(folder.string(), "lacks frames before its last checkpoint; see 'vdbfrac info'");
    return files;
}

class Embedder {
public:
    Embedder(const EmbedOptions& options, std::uint64_t limit)
        : options_(options),
          folder_(options.folder),
          last_(folder_, options, limit),
          motion_(motionFiles(readRunFrames(folder_), last_.prepared.simulation, folder_), bodies().size(), nodes())
    {
        const std::vector<Motion::State> rest = motion_.states(0);
        for (std::size_t b = 0; b < bodies().size(); ++b) {
            drawn_.push_back(last_.drawing.body(b, rest[b].x, rest[b].v));
            topology_.push_back(drawn_.back().topology.get());
            used_.push_back(tetmesh::usedPoints(topology_.back()->mesh));
        }
    }

    int write()
    {
        const fs::path out = options_.out;
        const std::string extension = out.extension().string();
        if (extension == ".obj") return writeObjAndMdd(out);
        if (extension == ".usda") return writeUsd(out);
        if (extension == ".ply") return writePly();
        throw InputError(
            {options_.out, "'" + extension + "' is not what is written here", ".obj (with .mdd), .usda, .ply", ""});
    }

private:
    const std::vector<scene::Body>& bodies() const { return last_.prepared.scene.bodies; }
    std::vector<std::size_t> nodes() const
    {
        std::vector<std::size_t> count;
        for (const core::Body& body : last_.prepared.simulation.bodies()) count.push_back(body.mesh->nodeCount());
        return count;
    }
    core::DrawnFrame drawnFrame(std::size_t f) const
    {
        core::DrawnFrame all;
        const std::vector<Motion::State> states = motion_.states(f);
        for (std::size_t b = 0; b < used_.size(); ++b) all.push_back(last_.drawing.body(b, states[b].x, states[b].v));
        return all;
    }
    std::vector<tetmesh::CacheFrame> frame(std::size_t f) const
    {
        std::vector<tetmesh::CacheFrame> all;
        const core::DrawnFrame drawn = drawnFrame(f);
        for (std::size_t b = 0; b < used_.size(); ++b) {
            tetmesh::CacheFrame& one = all.emplace_back();
            for (std::uint32_t p : used_[b]) {
                one.points.push_back(drawn[b].points[p]);
                one.velocities.push_back(drawn[b].velocity[p]);
            }
        }
        return all;
    }

    int writeObjAndMdd(const fs::path& out)
    {
        std::vector<tetmesh::DrawnPart> parts;
        std::size_t points = 0;
        for (std::size_t b = 0; b < drawn_.size(); ++b) {
            parts.push_back({*topology_[b], drawn_[b].points, drawn_[b].normals});
            points += used_[b].size();
        }
        const fs::path mtl = fs::path(out).replace_extension(".mtl"), mdd = fs::path(out).replace_extension(".mdd");
        tetmesh::writeMtl(mtl, last_.drawing.materials());
        tetmesh::writeObjWhole(out, parts, mtl.filename().string());
        std::vector<double> times;
        for (std::size_t f = 0; f < motion_.frames(); ++f) times.push_back(double(f) / last_.prepared.scene.time.fps);
        tetmesh::writeMdd(mdd, times, points, [&](std::size_t f) { return frame(f); });
        for (const fs::path& file : {out, mtl, mdd}) std::printf("%s\n", file.c_str());
        return kDone;
    }

    int writeUsd(const fs::path& out)
    {
        tetmesh::UsdScene scene{
            last_.prepared.scene.name, {}, last_.prepared.scene.time.fps, last_.prepared.scene.time.firstFrame};
        for (const scene::Body& body : bodies()) scene.names.push_back(body.name);
        tetmesh::writeUsda(out, scene, topology_, motion_.frames(), [&](std::size_t f) { return frame(f); });
        std::printf("%s\n", out.c_str());
        return kDone;
    }

    int writePly()
    {
        if (!isSequence(options_.out))
            throw InputError(
                {options_.out, "is one name for all frames", "a place for the frame, as in name.####.ply", ""});
        for (std::size_t f = 0; f < motion_.frames(); ++f) {
            const fs::path out = frameName(options_.out, last_.prepared.scene.time.firstFrame + int(f));
            const core::DrawnFrame drawn = drawnFrame(f);
            tetmesh::writePlyFrame(out, core::plyBodies(drawn), tetmesh::PlyOrder::asGiven);
            std::printf("%s\n", out.c_str());
        }
        return kDone;
    }

    const EmbedOptions& options_;
    fs::path folder_;
    LastState last_;
    Motion motion_;
    core::DrawnFrame drawn_;  // at rest
    std::vector<const tetmesh::DrawnTopology*> topology_;
    std::vector<std::vector<std::uint32_t>> used_;  // points of each body
};

}  // namespace

Action addEmbed(CLI::App& app)
{
    auto o = std::make_shared<EmbedOptions>();
    CLI::App* c = app.add_subcommand("embed", "One topology over all frames of a run, also of another render mesh");
    c->add_option("RUN", o->folder, "Folder that 'vdbfrac sim -o' wrote, with output.motion = true")->required();
    c->add_option("MESH", o->mesh, "Render mesh to draw instead of the body's own, where the body lies at rest");
    c->add_option("-o,--output", o->out,
                  ".obj, with the positions of its points in an .mdd beside it; .usda; or .ply with #### for the frame")
        ->required()
        ->type_name("FILE");
    c->add_option("--body", o->body, "Body that the mesh is for, of several")->type_name("NAME");
    addThreads(*c, o->threads);
    addMaxMemory(*c, o->maxMemory, "it");
    return [o] {
        const ThreadLimit threads(o->threads);
        return Embedder(*o, memoryLimitOf(o->maxMemory)).write();
    };
}

}  // namespace vdbfrac::cli
