#include <vdbfrac/core/run_folder.h>

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/hash.h>
#include <vdbfrac/core/version.h>
#include <vdbfrac/grid/world_fields.h>
#include <vdbfrac/tetmesh/obj_file.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <set>

namespace vdbfrac::core {

namespace fs = std::filesystem;

namespace {

/// Whatever a run writes into its folder, and so may remove from it.
constexpr const char* kOwnEntries[] = {"scene.toml", "run.json", "run.log", "stats.csv", "vdb", "obj", "preview"};

void prepare(const fs::path& folder, bool overwrite)
{
    std::error_code error;
    if (fs::is_regular_file(folder, error)) throw FileError(folder.string(), "is a file, not a folder");
    fs::create_directories(folder, error);
    if (error) throw FileError(folder.string(), "cannot be made: " + error.message());
    const bool empty = fs::is_empty(folder, error);
    if (error) throw FileError(folder.string(), "cannot be read: " + error.message());
    if (!empty && !overwrite)
        throw FileError(folder.string(), "is not empty; use --overwrite to replace an earlier run, or another folder");
    for (const char* entry : kOwnEntries) {
        fs::remove_all(folder / entry, error);
        if (error) throw FileError((folder / entry).string(), "cannot be removed: " + error.message());
    }
}

/// Shortest text that reads back as the same double.
std::string number(double v)
{
    char text[40];
    const auto end = std::to_chars(text, text + sizeof text, v).ptr;
    return std::string(text, end);
}

const char* word(Outcome outcome)
{
    switch (outcome) {
    case Outcome::converged: return "converged";
    case Outcome::cutback: return "cutback";
    case Outcome::capped: return "capped";
    }
    return "";
}

/// stage/count pairs that occur in any step, in a fixed order.
std::vector<std::pair<std::string, std::string>> countColumns(const std::vector<StepRecord>& steps)
{
    std::set<std::pair<std::string, std::string>> columns;
    for (const StepRecord& s : steps)
        for (const StageWork& stage : s.work.stages())
            for (const auto& [what, amount] : stage.counts) columns.insert({stage.name, what});
    return {columns.begin(), columns.end()};
}

std::set<std::string> stageColumns(const std::vector<StepRecord>& steps)
{
    std::set<std::string> columns;
    for (const StepRecord& s : steps)
        for (const StageWork& stage : s.work.stages()) columns.insert(stage.name);
    return columns;
}

/// Fields that the core itself writes.
bool isCoreField(const std::string& name)
{
    static constexpr const char* kNames[] = {"phi", "energy", "surface", "vel", "fragment_id"};
    return std::find(std::begin(kNames), std::end(kNames), name) != std::end(kNames);
}

void requireSources(const scene::Scene& scene, const Stages& stages)
{
    for (const std::string& name : scene.output.vdb) {
        const bool offered = std::any_of(stages.fields.begin(), stages.fields.end(), [&](const FieldSource* f) { return f->fieldName() == name; });
        if (!offered && !isCoreField(name))
            throw InputError({"output.vdb", "nothing in this scene makes the field '" + name + "'", "", "name the effect that makes it, or leave the field out"});
    }
}

bool isWorldField(const std::string& name) { return name == "surface" || name == "vel" || name == "fragment_id"; }

}  // namespace

std::string statsText(const std::vector<StepRecord>& steps, const scene::Scene& scene)
{
    const auto counts = countColumns(steps);
    const auto stages = stageColumns(steps);
    std::string text =
        "step,time_s,dt_s,status,cutbacks,newton_iterations,linear_iterations,projections,residual,kinetic_J,elastic_J,"
        "volume_m3,fragments,nodes,tets";
    for (const scene::Grip& g : scene.grips)
        for (const char* axis : {"x", "y", "z"}) text += ",load_" + g.name + "_" + axis + "_N";
    for (const auto& [stage, what] : counts) text += "," + stage + "_" + what;
    for (const std::string& stage : stages) text += "," + stage + "_s";
    text += '\n';
    for (const StepRecord& s : steps) {
        text += std::to_string(s.step) + ',' + number(s.time) + ',' + number(s.dt) + ',' + word(s.outcome) + ',' +
                std::to_string(s.cutbacks) + ',' + std::to_string(s.newtonIterations) + ',' + std::to_string(s.linearIterations) +
                ',' + std::to_string(s.projections) + ',' + number(s.residual) + ',' + number(s.kineticEnergy) + ',' +
                number(s.elasticEnergy) + ',' + number(s.volume) + ',' + std::to_string(s.fragments) + ',' +
                std::to_string(s.nodes) + ',' + std::to_string(s.tets);
        for (const Vec3& load : s.gripLoad) text += ',' + number(load.x()) + ',' + number(load.y()) + ',' + number(load.z());
        for (const auto& [stage, what] : counts) text += ',' + std::to_string(s.work.countOf(stage, what));
        for (const std::string& stage : stages) text += ',' + number(s.work.secondsOf(stage));
        text += '\n';
    }
    return text;
}

RunFolder::RunFolder(fs::path folder, const scene::Scene& scene, const Stages& stages, bool overwrite)
    : folder_(std::move(folder)), scene_(scene)
{
    requireSources(scene, stages);
    prepare(folder_, overwrite);
    if (!scene.output.vdb.empty()) fs::create_directory(folder_ / "vdb");
    if (scene.output.obj) {
        fs::create_directory(folder_ / "obj");
        tetmesh::writeMtl(folder_ / "obj" / (scene.name + ".mtl"));
    }
}

std::string RunFolder::sequenceName(const char* kind, int frame, const char* extension) const
{
    char number[16];
    std::snprintf(number, sizeof number, ".%04d.", frame);
    return std::string(kind) + "/" + scene_.name + number + extension;
}

void RunFolder::note(FrameRecord& record, const std::string& relative)
{
    const std::string content = readText(folder_ / relative);
    record.files.push_back({relative, content.size(), hexadecimal(hashBytes(content.data(), content.size()))});
}

grid::NamedGrid RunFolder::restField(const Simulation& simulation, const Body& body, const std::string& name) const
{
    grid::NamedGrid g;
    g.name = simulation.bodies().size() > 1 ? name + "_" + body.name : name;
    g.voxelSize = scene_.grid.voxelSize;
    if (name == "phi") {
        g.levelSet = &body.phi, g.unit = "m";
    } else if (name == "energy") {
        g.values = simulation.energyField(body), g.unit = "J/m^3";
    } else {
        g.unit = "s";
        for (const FieldSource* source : simulation.stages().fields)
            if (source->fieldName() == name) g.values = source->field(body);
    }
    return g;
}

void RunFolder::writeVdbFrame(const Simulation& simulation, FrameRecord& record)
{
    const auto& names = scene_.output.vdb;
    grid::WorldFields world;
    if (std::any_of(names.begin(), names.end(), isWorldField)) {
        const Simulation::MovingSurface moving = simulation.surface();
        world = grid::worldFields(moving.surface, moving.velocity, scene_.grid.voxelSize);
    }
    std::vector<grid::NamedGrid> grids;
    for (const std::string& name : names) {
        if (name == "surface")
            grids.push_back({name, &world.surface, {}, scene_.grid.voxelSize, "m"});
        else if (name == "vel")
            grids.push_back({name, nullptr, world.velocity, scene_.grid.voxelSize, "m/s"});
        else if (name == "fragment_id")
            grids.push_back({name, nullptr, world.fragment, scene_.grid.voxelSize, ""});
        else
            for (const Body& body : simulation.bodies()) grids.push_back(restField(simulation, body, name));
    }
    const grid::Metadata metadata = {{"creator", std::string("vdbfrac ") + kVersion},
                                     {"scene", scene_.name},
                                     {"frame", std::int64_t(record.frame)},
                                     {"time", record.time},
                                     {"fps", scene_.time.fps},
                                     {"length_unit", std::string("m")},
                                     {"up_axis", std::string("y")}};
    const std::string relative = sequenceName("vdb", record.frame, "vdb");
    grid::writeVdb(folder_ / relative, grids, metadata);
    note(record, relative);
}

void RunFolder::writeObjFrame(const Simulation& simulation, FrameRecord& record)
{
    const std::string relative = sequenceName("obj", record.frame, "obj");
    tetmesh::writeObj(folder_ / relative, simulation.surface().surface, scene_.name + ".mtl");
    note(record, relative);
}

const FrameRecord& RunFolder::writeFrame(const Simulation& simulation, int frame)
{
    FrameRecord record;
    record.frame = frame;
    record.time = simulation.time();
    record.stateHash = hexadecimal(simulation.stateHash());
    if (!scene_.output.vdb.empty()) writeVdbFrame(simulation, record);
    if (scene_.output.obj) writeObjFrame(simulation, record);
    frames_.push_back(std::move(record));
    writeStats();
    writeManifest(simulation, "running");
    return frames_.back();
}

void RunFolder::finish(const Simulation& simulation, const std::string& status)
{
    writeStats();
    writeManifest(simulation, status);
}

void RunFolder::writeStats() const { writeText(folder_ / "stats.csv", statsText(steps_, scene_)); }

void RunFolder::writeManifest(const Simulation& simulation, const std::string& status) const
{
    using nlohmann::json;
    json frames = json::array(), fragments = json::array();
    for (const FrameRecord& f : frames_) {
        json files = json::array();
        for (const WrittenFile& w : f.files) files.push_back({{"path", w.path}, {"bytes", w.bytes}, {"xxh3", w.checksum}});
        frames.push_back({{"frame", f.frame}, {"time", f.time}, {"state_hash", f.stateHash}, {"files", files}});
    }
    for (const Body& body : simulation.bodies())
        for (const tetmesh::Fragment& f : body.fragments.fragments()) {
            json entry = {{"id", f.id}, {"body", body.name}, {"birth", f.birth}, {"rest_volume", f.restVolume}};
            entry["parent"] = f.parent < 0 ? json() : json(f.parent);
            fragments.push_back(entry);
        }
    const json manifest = {{"creator", std::string("vdbfrac ") + kVersion},
                           {"scene", scene_.name},
                           {"status", status},
                           {"fps", scene_.time.fps},
                           {"units", {{"length", "m"}, {"mass", "kg"}, {"time", "s"}}},
                           {"up_axis", "y"},
                           {"voxel_size", scene_.grid.voxelSize},
                           {"frame_range", {scene_.time.firstFrame, scene_.time.lastFrame}},
                           {"steps", steps_.size()},
                           {"start_volume", simulation.startVolume()},
                           {"volume", simulation.volume()},
                           {"frames", frames},
                           {"fragments", fragments}};
    writeText(folder_ / "run.json", manifest.dump(1) + "\n");
}

}  // namespace vdbfrac::core
