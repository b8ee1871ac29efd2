#include "frame_writer.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/hash.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/core/point_cache.h>
#include <vdbfrac/core/version.h>
#include <vdbfrac/grid/world_fields.h>
#include <vdbfrac/tetmesh/obj_file.h>

#include <algorithm>
#include <functional>

namespace vdbfrac::core {

namespace fs = std::filesystem;

namespace {

/// Grids of world space are made of the deformed surface, when the file is written.
struct WorldField {
    const char *name, *unit;
    void (*fill)(grid::NamedGrid& grid, grid::WorldFields& fields);
};
constexpr WorldField kWorldFields[] = {
    {"surface", "m", [](grid::NamedGrid& g, grid::WorldFields& fields) { g.levelSet = &fields.surface; }},
    {"vel", "m/s", [](grid::NamedGrid& g, grid::WorldFields& fields) { g.values = std::move(fields.velocity); }},
    {"fragment_id", "", [](grid::NamedGrid& g, grid::WorldFields& fields) { g.values = std::move(fields.fragment); }},
};

const WorldField* worldField(const std::string& name)
{
    const auto it = std::find_if(std::begin(kWorldFields), std::end(kWorldFields),
                                 [&](const WorldField& field) { return field.name == name; });
    return it != std::end(kWorldFields) ? it : nullptr;
}

/// A field of the rest configuration, of a body; `levelSets` keeps what is one.
grid::NamedGrid restGrid(const FrameSource& source, const FrameSource::Field& field, const Body& body,
                         std::list<grid::LevelSet>& levelSets)
{
    grid::NamedGrid g;
    g.name = field.name, g.unit = field.unit;
    g.voxelSize = body.phi.voxelSize();
    FrameGrid taken = source.take(body, field.name);
    if (auto* values = std::get_if<grid::VoxelValues>(&taken))
        g.values = std::move(*values);
    else
        g.levelSet = &levelSets.emplace_back(std::get<grid::LevelSet>(std::move(taken)));
    return g;
}

/// More than one, for the case that a disk loses the last.
constexpr std::size_t kKeptCheckpoints = 2;

/// stats.csv and run.json are written whole, so the seldomer the longer they are: they shall take no more than this
/// part of the time.
constexpr double kShareOfTables = 0.02;

std::string checksumOf(const std::string& content) { return hexadecimal(hashBytes(content.data(), content.size())); }

}  // namespace

std::vector<fs::path> checkpointsIn(const fs::path& folder)
{
    const fs::path place = folder / kCheckpointFolder;
    std::vector<fs::path> files;
    std::error_code error;
    for (fs::directory_iterator entry(place, error), end; !error && entry != end; entry.increment(error))
        if (entry->path().extension() == kCheckpointExtension && !isTemporary(entry->path()))
            files.push_back(entry->path());
    if (error && error != std::errc::no_such_file_or_directory)
        throw FileError(place.string(), "cannot be read: " + error.message());
    // Newest last: by their steps, of which later ones may have more digits.
    std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
        const std::string& s = a.native();
        const std::string& t = b.native();
        return std::make_pair(s.size(), s) < std::make_pair(t.size(), t);
    });
    return files;
}

scene::Vocabulary::Fields outputFields()
{
    std::vector<std::string> world;
    for (const WorldField& field : kWorldFields) world.push_back(field.name);
    return {{"phi", "energy"}, std::move(world)};
}

void requireSources(const scene::Scene& scene, const Stages& stages)
{
    const auto has = [](const std::vector<std::string>& names, const std::string& name) {
        return std::find(names.begin(), names.end(), name) != names.end();
    };
    const scene::Vocabulary::Fields own = outputFields();
    std::vector<InputError::Detail> wrong;
    for (const std::string& name : scene.output.vdb)
        if (!has(own.rest, name) && !has(own.deformed, name) && !stages.sourceOf(name))
            wrong.push_back(
                {scene.file.string() + ": output.vdb", "nothing in this scene makes the field '" + name + "'", "",
                 "name the effect that makes it, with settings under which it does, or leave the field out"});
    if (!wrong.empty()) throw InputError(std::move(wrong));
}

RunState runState(const Simulation& simulation)
{
    RunState state;
    for (const Body& body : simulation.bodies())
        for (const tetmesh::Fragment& f : body.fragments.fragments()) state.fragments.push_back({body.name, f});
    state.startVolume = simulation.startVolume();
    state.volume = simulation.volume();
    return state;
}

bool isDrawn(const scene::Output& output)
{
    return output.obj || output.ply || std::any_of(output.vdb.begin(), output.vdb.end(), worldField);
}

FrameData takeFrame(const Simulation& simulation, const scene::Scene& scene, int frame)
{
    FrameData data;
    data.record.frame = frame;
    data.record.time = simulation.time();
    data.record.stateHash = hexadecimal(simulation.stateHash());
    const auto& names = scene.output.vdb;
    for (const std::string& name : names) {
        if (const WorldField* field = worldField(name)) {
            data.grids.push_back({name, nullptr, {}, scene.grid.voxelSize, field->unit});
            continue;
        }
        const auto of = simulation.stages().sourceOf(name);
        if (!of) continue;
        std::vector<std::size_t> ofBodies;
        for (const Body& body : simulation.bodies()) {
            ofBodies.push_back(data.grids.size());
            data.grids.push_back(restGrid(*of->source, of->field, body, data.levelSets));
            if (simulation.bodies().size() > 1) data.grids.back().name += "_" + body.name;
        }
        if (!data.grids.back().levelSet) data.restValues.emplace_back(name, std::move(ofBodies));
    }
    if (simulation.ancestry()) data.motion = motionOf(simulation);
    data.state = runState(simulation);
    return data;
}

std::string RunFolder::Writer::sequenceName(const char* kind, int frame, const char* extension) const
{
    char number[16];
    std::snprintf(number, sizeof number, ".%04d.", frame);
    return std::string(kind) + "/" + scene_.name + number + extension;
}

WrittenFile RunFolder::Writer::readBack(const std::string& relative) const
{
    const std::string content = readText(folder_ / relative);
    return {relative, content.size(), checksumOf(content)};
}

RunFolder::Writer::Writer(fs::path folder, const scene::Scene& scene)
    : folder_(std::move(folder)), scene_(scene), log_(folder_ / kCheckpointFolder / (scene.name + kRecordsExtension))
{
}

RunFolder::Writer::~Writer()
{
    try {
        if (behind_) writeAll(kRunning);
    } catch (const std::exception&) {  // whoever waited for the writer has heard of it; a checkpoint has all of it
    }
}

std::string RunFolder::Writer::writeVdb(FrameData& data) const
{
    grid::WorldFields world;
    if (std::any_of(scene_.output.vdb.begin(), scene_.output.vdb.end(), worldField)) {
        const MovingSurface moving = movingSurface(data.drawn);
        world = grid::worldFields(moving.surface, moving.velocity, scene_.grid.voxelSize);
    }
    for (grid::NamedGrid& g : data.grids)
        if (const WorldField* field = worldField(g.name)) field->fill(g, world);
    const grid::Metadata metadata = {
        {"creator", std::string(kCreator)}, {"scene", scene_.name},   {"frame", std::int64_t(data.record.frame)},
        {"time", data.record.time},         {"fps", scene_.time.fps}, {"length_unit", std::string("m")},
        {"up_axis", std::string("y")}};
    const std::string relative = sequenceName("vdb", data.record.frame, "vdb");
    grid::writeVdb(folder_ / relative, data.grids, metadata);
    return relative;
}

/// With the values of what the .vdb has at rest.
std::string RunFolder::Writer::writePly(const FrameData& data) const
{
    std::vector<tetmesh::PlyBody> bodies = plyBodies(data.drawn);
    std::vector<std::string> names;
    for (const auto& [name, grids] : data.restValues) {
        names.push_back(name);
        for (std::size_t b = 0; b < bodies.size(); ++b)
            bodies[b].values.push_back(
                grid::sample(data.grids[grids[b]].values, scene_.grid.voxelSize, bodies[b].topology.mesh.points));
    }
    const std::string relative = sequenceName("ply", data.record.frame, "ply");
    tetmesh::writePlyFrame(folder_ / relative, bodies, tetmesh::PlyOrder::byFragment, names);
    return relative;
}

std::string RunFolder::Writer::writeObj(const FrameData& data) const
{
    const std::string relative = sequenceName("obj", data.record.frame, "obj");
    std::vector<tetmesh::DrawnPart> parts;
    for (const DrawnBody& body : data.drawn) parts.push_back({*body.topology, body.points, body.normals});
    tetmesh::writeObjFrame(folder_ / relative, parts, scene_.name + ".mtl");
    return relative;
}

std::string RunFolder::Writer::writeMotion(const FrameData& data) const
{
    const std::string relative = sequenceName("motion", data.record.frame, "motion");
    data.motion.write(folder_ / relative);
    return relative;
}

void RunFolder::Writer::write(FrameData& data)
{
    addSteps(data.steps);                             // before what may fail: they tell what led to it
    std::vector<std::function<std::string()>> files;  // side by side: each writes one
    if (!scene_.output.vdb.empty()) files.emplace_back([&] { return writeVdb(data); });
    if (scene_.output.obj) files.emplace_back([&] { return writeObj(data); });
    if (scene_.output.ply) files.emplace_back([&] { return writePly(data); });
    if (scene_.output.followsNodes()) files.emplace_back([&] { return writeMotion(data); });
    data.record.files.resize(files.size());
    parallelChunks(files.size(), 1, [&](std::size_t i, std::size_t) { data.record.files[i] = readBack(files[i]()); });
    frames_.push_back(std::move(data.record));
    state_ = std::move(data.state);
    behind_ = true;
    if (std::chrono::steady_clock::now() - written_ >= took_ / kShareOfTables) writeAll(kRunning);
}

void RunFolder::Writer::writePointCache(const Simulation& simulation, const Drawing& drawing)
{
    std::vector<fs::path> motion;
    for (const FrameRecord& frame : frames_)
        for (const WrittenFile& file : frame.files)
            if (file.path.ends_with(".motion")) motion.push_back(folder_ / file.path);
    const PointCache cache(scene_, simulation, drawing, motion);
    pointCacheLacks_ = cache.lacks();
    for (const std::string& kind : scene_.output.pointCache)
        for (const fs::path& file : cache.write(folder_ / "cache" / (scene_.name + (kind == "mdd" ? ".obj" : ".usda"))))
            pointCache_.push_back(readBack(fs::relative(file, folder_)));
}

void RunFolder::Writer::writeTables(const std::vector<StepRecord>& steps, const RunState& state,
                                    const std::string& status, const std::string& error)
{
    addSteps(steps);
    state_ = state;
    error_ = error;
    writeAll(status);
}

void RunFolder::Writer::writeAll(const std::string& status)
{
    const auto start = std::chrono::steady_clock::now();
    writeText(folder_ / "stats.csv", statsText(steps_, scene_));
    writeManifest(state_, status);
    behind_ = false;
    written_ = std::chrono::steady_clock::now();
    took_ = written_ - start;
}

RecordLog::Records RunFolder::Writer::readRecords(const Archive& archive)
{
    const auto mark = archive.get<std::uint64_t>("records", 2);
    return log_.goOnFrom({mark[0], mark[1]});
}

void RunFolder::Writer::goOnFrom(const std::string& checkpoint, RecordLog::Records records)
{
    checkpoints_.clear();
    for (const fs::path& file : checkpointsIn(folder_)) {
        const bool isIt = file.filename() == checkpoint;
        if (keepsCheckpoints_ || isIt) checkpoints_.push_back(file.filename());
        if (isIt) break;
    }
    steps_ = std::move(records.steps);
    frames_ = std::move(records.frames);
    loggedSteps_ = steps_.size(), loggedFrames_ = frames_.size();
}

/// Checkpoints first: however soon this is killed, no checkpoint tells of frames that are gone.
void RunFolder::Writer::removeLater(const std::string& checkpoint) const
{
    bool isLater = false;
    for (const fs::path& file : checkpointsIn(folder_)) {
        std::error_code error;
        if (isLater) fs::remove(file, error);
        if (error) throw FileError(file.string(), "cannot be removed: " + error.message());
        isLater = isLater || file.filename() == checkpoint;
    }
    core::removeLaterFrames(folder_, scene_.name, frames_.empty() ? scene_.time.firstFrame - 1 : frames_.back().frame);
}

void RunFolder::Writer::takeOver(const fs::path& run, RecordLog::Records records)
{
    for (const FrameRecord& frame : records.frames)
        for (const WrittenFile& file : frame.files) {
            const fs::path from = run / file.path, to = folder_ / file.path;
            const auto isWhole = [&](const fs::path& copy) {
                if (const std::string content = readText(copy); checksumOf(content) != file.checksum)
                    throw Error("is not what the run in " + run.string() + " wrote");
            };
            makeFolder(to.parent_path());
            writeAtomically(
                to, [&](const fs::path& copy) { fs::copy_file(from, copy, fs::copy_options::overwrite_existing); },
                isWhole);
        }
    steps_ = std::move(records.steps);
    frames_ = std::move(records.frames);
}

void RunFolder::Writer::writeCheckpoint(Archive& archive, const std::vector<StepRecord>& steps)
{
    addSteps(steps);
    char name[32];
    std::snprintf(name, sizeof name, ".%06d", steps_.empty() ? 0 : steps_.back().step);
    const fs::path folder = folder_ / kCheckpointFolder;
    makeFolder(folder);
    const RecordLog::Mark mark =
        log_.append(std::span(steps_).subspan(loggedSteps_), std::span(frames_).subspan(loggedFrames_));
    loggedSteps_ = steps_.size(), loggedFrames_ = frames_.size();
    archive.put("records", std::vector<std::uint64_t>{mark.bytes, mark.hash});
    const std::string file = scene_.name + name + kCheckpointExtension;
    archive.write(folder / file);
    if (checkpoints_.empty() || checkpoints_.back() != file) checkpoints_.push_back(file);  // not that of a branch
    if (!keepsCheckpoints_ && checkpoints_.size() > kKeptCheckpoints) checkpoints_.erase(checkpoints_.begin());
    std::error_code stays;
    for (const fs::path& other : checkpointsIn(folder_))
        if (std::find(checkpoints_.begin(), checkpoints_.end(), other.filename()) == checkpoints_.end())
            fs::remove(other, stays);
}

void RunFolder::Writer::writeManifest(const RunState& state, const std::string& status) const
{
    using nlohmann::json;
    json fragments = json::array();
    for (const auto& [body, f] : state.fragments) {
        json entry = {{"id", f.id}, {"body", body}, {"birth", f.birth}, {"rest_volume", f.restVolume}};
        entry["parent"] = f.parent < 0 ? json() : json(f.parent);
        fragments.push_back(entry);
    }
    json manifest = {{"creator", kCreator},
                     {"scene", scene_.name},
                     {"status", status},
                     {"fps", scene_.time.fps},
                     {"units", {{"length", "m"}, {"mass", "kg"}, {"time", "s"}}},
                     {"up_axis", "y"},
                     {"voxel_size", scene_.grid.voxelSize},
                     {"frame_range", {scene_.time.firstFrame, scene_.time.lastFrame}},
                     {"steps", steps_.size()},
                     {"start_volume", state.startVolume},
                     {"volume", state.volume},
                     {"max_unnamed_share", maxUnnamedShare(steps_)},
                     {"writes", runFiles(scene_.name)},
                     {"frames", framesJson(frames_)},
                     {"fragments", fragments}};
    if (!pointCache_.empty()) manifest["point_cache"] = filesJson(pointCache_);
    if (!error_.empty()) manifest["error"] = error_;
    if (keepsCheckpoints_) manifest["keeps_checkpoints"] = true;
    if (!branches_.empty()) manifest["branches"] = branchesJson(branches_);
    writeText(folder_ / kManifest, manifest.dump(1, ' ', false, json::error_handler_t::replace) + "\n");
}

}  // namespace vdbfrac::core
