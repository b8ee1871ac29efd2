#include <vdbfrac/core/run_folder.h>

#include "frame_writer.h"
#include "run_records.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/hash.h>
#include <vdbfrac/core/version.h>
#include <vdbfrac/tetmesh/obj_file.h>

#include <algorithm>
#include <sstream>

namespace vdbfrac::core {

namespace fs = std::filesystem;

namespace {

/// Frames that may wait for the writer: with the one it is at, and one that is handed over, three are in memory at most.
constexpr std::size_t kWaitingFrames = 1;

/// Whatever a run writes into its folder, and so may remove from it: in this order, so that whoever is killed in between leaves no
/// checkpoint whose frames are gone.
constexpr const char* kOwnEntries[] = {"run.json", kCheckpointFolder, "scene.toml", "run.log", "stats.csv", "vdb", "obj", "preview"};

FolderLock prepare(const fs::path& folder, Earlier earlier)
{
    std::error_code error;
    if (fs::is_regular_file(folder, error)) throw FileError(folder.string(), "is a file, not a folder");
    fs::create_directories(folder, error);
    if (error) throw FileError(folder.string(), "cannot be made: " + error.message());
    FolderLock lock(folder);
    if (earlier == Earlier::keep) removeTemporaries(folder);
    const bool empty = fs::is_empty(folder, error);
    if (error) throw FileError(folder.string(), "cannot be read: " + error.message());
    if (!empty && earlier == Earlier::refuse)
        throw FileError(folder.string(), "is not empty; use --resume to go on with an earlier run, --overwrite to replace it, or another folder");
    if (earlier == Earlier::keep) {
        const auto isThere = [&](const char* entry) { return fs::exists(folder / entry); };
        if (!empty && std::none_of(std::begin(kOwnEntries), std::end(kOwnEntries), isThere))
            throw FileError(folder.string(), "is not empty and holds no run to resume; use another folder");
        for (const char* entry : kOwnEntries) removeTemporaries(folder / entry);
        return lock;
    }
    for (const char* entry : kOwnEntries) {
        fs::remove_all(folder / entry, error);
        if (error) throw FileError((folder / entry).string(), "cannot be removed: " + error.message());
    }
    return lock;
}

/// Fields that the core itself writes.
bool isCoreField(const std::string& name)
{
    return name == "phi" || name == "energy" || isWorldField(name);
}

void requireSources(const scene::Scene& scene, const Stages& stages)
{
    for (const std::string& name : scene.output.vdb) {
        const bool offered = std::any_of(stages.fields.begin(), stages.fields.end(), [&](const FieldSource* f) { return f->fieldName() == name; });
        if (!offered && !isCoreField(name))
            throw InputError({"output.vdb", "nothing in this scene makes the field '" + name + "'", "", "name the effect that makes it, or leave the field out"});
    }
}

/// Throws InputError where the settings are not what they were.
void requireSame(const std::string& settings, const std::string& before)
{
    if (settings == before) return;
    std::istringstream now(settings), then(before);
    std::string table;
    for (std::string line, was; ;) {
        const bool more = bool(std::getline(now, line)), had = bool(std::getline(then, was));
        if (more && had && line == was) {
            if (line.starts_with('[')) table = line + " ";
            continue;
        }
        throw InputError({"--resume", "the scene is not that of the run: " + table + (more ? "'" + line + "'" : std::string("its end")) + " was " +
                                          (had ? "'" + was + "'" : std::string("its end")),
                          "the scene of the run; only its last frame may differ", "or start again with --overwrite"});
    }
}

}  // namespace

RunFolder::RunFolder(fs::path folder, const scene::Scene& scene, const Stages& stages, Earlier earlier)
    : folder_(std::move(folder)), scene_(scene), writer_(std::make_unique<Writer>(folder_, scene)), queue_(kWaitingFrames)
{
    requireSources(scene, stages);
    lock_ = prepare(folder_, earlier);
    if (!scene.output.vdb.empty()) fs::create_directory(folder_ / "vdb");
    if (scene.output.obj) {
        fs::create_directory(folder_ / "obj");
        tetmesh::writeMtl(folder_ / "obj" / (scene.name + ".mtl"));
    }
}

RunFolder::~RunFolder() = default;

const std::vector<FrameRecord>& RunFolder::frames() const { return writer_->frames(); }

std::vector<StepRecord> RunFolder::newSteps()
{
    std::vector<StepRecord> steps(steps_.begin() + std::ptrdiff_t(handedOver_), steps_.end());
    handedOver_ = steps_.size();
    return steps;
}

std::string RunFolder::writeFrame(const Simulation& simulation, int frame)
{
    std::shared_ptr<FrameData> data;  // shared, since jobs are copyable
    {
        const StageTimer timer(work_, "snapshot");
        data = std::make_shared<FrameData>(takeFrame(simulation, scene_, frame));
        data->steps = newSteps();
    }
    const std::string hash = data->record.stateHash;
    queue_.push([writer = writer_.get(), data = std::move(data)] { writer->write(*data); });
    return hash;
}

void RunFolder::writeCheckpoint(const Simulation& simulation, const std::string& settings)
{
    if (simulation.steps() == checkpointed_) return;
    checkpointed_ = simulation.steps();
    const std::string hash = hexadecimal(simulation.stateHash());
    if (simulation.steps() == 0) restHash_ = hash;
    auto archive = std::make_shared<Archive>();
    {
        const StageTimer timer(work_, "snapshot");
        archive->putText("creator", kCreator);
        archive->putText("settings", settings);
        archive->putText("rest_hash", restHash_);
        archive->putText("state_hash", hash);
        simulation.save(*archive);
    }
    queue_.push([writer = writer_.get(), archive = std::move(archive), steps = newSteps()] { writer->writeCheckpoint(*archive, steps); });
}

bool RunFolder::resume(Simulation& simulation, const Resume& how, std::vector<std::string>& notes)
{
    std::vector<fs::path> checkpoints = checkpointsIn(folder_);
    if (checkpoints.empty()) {
        if (!fs::exists(folder_ / "run.json")) return false;
        throw FileError(folder_.string(), "holds frames but no checkpoint; use --overwrite to start again, or another folder");
    }
    std::string passed;
    for (std::reverse(checkpoints.begin(), checkpoints.end()); const fs::path& file : checkpoints) {
        Archive archive;
        std::vector<FrameRecord> frames;
        try {
            archive = Archive::read(file, how.memoryLimit);
            frames = loadFrames(archive);
        } catch (const FileError& e) {
            passed += std::string("; ") + e.what();
            continue;
        }
        if (!frames.empty() && frames.back().frame > how.lastFrame) continue;
        goOn(simulation, how.settings, archive, frames);
        writer_->goOnFrom(file.filename(), steps_, std::move(frames));
        if (!passed.empty()) notes.push_back("an older checkpoint is taken" + passed);
        return true;
    }
    throw FileError((folder_ / kCheckpointFolder).string(), "has no whole checkpoint up to frame " + std::to_string(how.lastFrame) + passed);
}

void RunFolder::goOn(Simulation& simulation, const std::string& settings, const Archive& archive, const std::vector<FrameRecord>& frames)
{
    const auto refuse = [](const std::string& what) {
        throw InputError({"--resume", what, "", "start again with --overwrite, or in another folder"});
    };
    if (const std::string creator = archive.getText("creator"); creator != kCreator) refuse("the run was made by " + creator + ", this is " + kCreator);
    requireSame(settings, archive.getText("settings"));
    restHash_ = archive.getText("rest_hash");
    if (restHash_ != hexadecimal(simulation.stateHash()))
        refuse("the bodies at rest are not those of the run: a mesh, a .vdb file or the program has changed since");
    simulation.load(archive);
    if (archive.getText("state_hash") != hexadecimal(simulation.stateHash())) archive.complain("the state it leads to is not the one that was saved");
    steps_ = loadSteps(archive);
    bool sound = int(steps_.size()) == simulation.steps() && int(frames.size()) <= simulation.framesDone() + 1;
    for (std::size_t i = 0; i < frames.size(); ++i) sound = sound && frames[i].frame == scene_.time.firstFrame + int(i);
    if (!sound) archive.complain("its steps and frames do not go together");
    handedOver_ = steps_.size();
    checkpointed_ = simulation.steps();
}

void RunFolder::finish(const Simulation& simulation, const std::string& status)
{
    queue_.push([writer = writer_.get(), steps = newSteps(), state = runState(simulation), status] {
        writer->writeTables(steps, state, status);
    });
    queue_.finish();
}

Ledger RunFolder::work() const
{
    Ledger work = work_;
    work.addSeconds("output", queue_.secondsWorked());
    work.count("output", "calls", std::int64_t(frames().size()));
    for (const FrameRecord& frame : frames())
        for (const WrittenFile& file : frame.files) work.count("output", "bytes", std::int64_t(file.bytes));
    work.addSeconds("wait", queue_.secondsWaited());
    return work;
}

}  // namespace vdbfrac::core
