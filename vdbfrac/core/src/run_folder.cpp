#include <vdbfrac/core/run_folder.h>

#include "frame_writer.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/hash.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/core/version.h>
#include <vdbfrac/tetmesh/mtl_file.h>

#include <algorithm>
#include <set>
#include <sstream>
#include <utility>

namespace vdbfrac::core {

namespace fs = std::filesystem;

namespace {

/// Frames that may wait for the writer: with the one it is at, and one that is handed over, three are in memory at
/// most.
constexpr std::size_t kWaitingFrames = 1;

/// A run that was killed at once has left nothing but a manifest that was not finished.
bool isEmpty(const fs::path& folder)
{
    std::error_code error;
    bool empty = true;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
        empty = empty && isTemporary(entry->path()) && entry->path().filename().string().ends_with(kManifest);
    if (error) throw FileError(folder.string(), "cannot be read: " + error.message());
    return empty;
}

/// Takes an empty folder, or one with an earlier run of this program and nothing of the scene's among its files. That
/// run stays as it is; `removes`: what of it has to go.
FolderLock prepare(const fs::path& folder, const scene::Scene& scene, ExistingRun existing,
                   std::vector<std::string>& removes)
{
    std::error_code error;
    if (fs::is_regular_file(folder, error)) throw FileError(folder.string(), "is a file, not a folder");
    makeFolder(folder);
    FolderLock lock(folder);
    if (isEmpty(folder)) return lock;
    if (existing == ExistingRun::refuse)
        throw FileError(
            folder.string(),
            "is not empty; use --resume to continue an earlier run, --overwrite to replace it, or another folder");
    // A manifest that was lost is made again from the checkpoints, by whoever goes on.
    const bool mayBeLost = existing == ExistingRun::keep && !checkpointsIn(folder).empty();
    const std::vector<std::string> before =
        filesOfEarlierRun(folder, mayBeLost ? runFiles(scene.name) : std::vector<std::string>());
    std::vector<fs::path> inputs = inputsOf(scene);
    const fs::path own = folder / "scene.toml";
    // Is left as it is.
    if (existing == ExistingRun::keep)
        std::erase_if(inputs, [&](const fs::path& file) { return fs::equivalent(file, own, error); });
    requireApart(folder, before, inputs, existing == ExistingRun::keep ? "write over" : "remove");
    requireApart(folder, runFiles(scene.name), inputs, "write over");
    std::set<fs::path> places;
    for (const std::string& file : runFiles(scene.name)) places.insert((folder / file).parent_path());
    for (const fs::path& place : places) removeTemporaries(place);
    if (existing == ExistingRun::replace) removes = before;
    return lock;
}

/// Throws InputError where the settings are not what they were.
void requireSame(const std::string& settings, const std::string& before)
{
    if (settings == before) return;
    std::istringstream now(settings), then(before);
    std::string table;
    for (std::string line, was;;) {
        const bool more = bool(std::getline(now, line)), had = bool(std::getline(then, was));
        if (more && had && line == was) {
            if (line.starts_with('[')) table = line + " ";
            continue;
        }
        throw InputError({"--resume",
                          "the scene is not that of the run: " + table +
                              (more ? "'" + line + "'" : std::string("its end")) + " was " +
                              (had ? "'" + was + "'" : std::string("its end")),
                          "the scene of the run; only its last frame may differ",
                          "--resume=FRAME continues from there with other settings; --overwrite starts again"});
    }
}

}  // namespace

std::vector<fs::path> inputsOf(const scene::Scene& scene)
{
    std::vector<fs::path> files = {scene.file};
    for (const scene::Body& body : scene.bodies)
        if (const fs::path* file = scene::fileOf(body.shape)) files.push_back(*file);
    for (const scene::Collider& collider : scene.colliders)
        if (const fs::path* file = scene::fileOf(collider.shape)) files.push_back(*file);
    return files;
}

RunFolder::RunFolder(fs::path folder, const scene::Scene& scene, const Simulation& simulation, ExistingRun existing)
    : folder_(std::move(folder)),
      scene_(scene),
      bodyFilesHash_(filesHash(scene.bodies)),
      collidersHash_(filesHash(scene.colliders)),
      writer_(std::make_unique<Writer>(folder_, scene)),
      queue_(kWaitingFrames)
{
    requireSources(scene, simulation.stages());
    lock_ = prepare(folder_, scene, existing, removes_);
    if (isDrawn(scene.output) || !scene.output.pointCache.empty())
        drawing_ = std::make_unique<Drawing>(scene, simulation);
}

void RunFolder::open()
{
    if (std::exchange(isOpen_, true)) return;
    removeRunFiles(folder_, removes_);
    // From here on the folder is known to hold a run.
    if (!fs::exists(folder_ / kManifest)) writer_->writeFirstManifest();
    if (!scene_.output.vdb.empty()) makeFolder(folder_ / "vdb");
    if (scene_.output.ply) makeFolder(folder_ / "ply");
    if (scene_.output.followsNodes()) makeFolder(folder_ / "motion");
    if (!scene_.output.pointCache.empty()) makeFolder(folder_ / "cache");
    if (scene_.output.obj) {
        makeFolder(folder_ / "obj");
        tetmesh::writeMtl(folder_ / "obj" / (scene_.name + ".mtl"), drawing_->materials());
    }
}

RunFolder::~RunFolder() = default;

std::span<const std::string> RunFolder::notes() const
{
    return drawing_ ? std::span<const std::string>(drawing_->notes()) : std::span<const std::string>();
}

const std::vector<FrameRecord>& RunFolder::frames() const { return writer_->frames(); }
const std::string& RunFolder::pointCacheLacks() const { return writer_->pointCacheLacks(); }

std::vector<StepRecord> RunFolder::newSteps()
{
    std::vector<StepRecord> steps(steps_.begin() + std::ptrdiff_t(handedOver_), steps_.end());
    handedOver_ = steps_.size();
    return steps;
}

/// After an error of the writer nothing is left in the queue: what it does not know then is handed over again.
void RunFolder::handOver(std::function<void()> job)
{
    try {
        queue_.push(std::move(job));
    } catch (...) {
        handedOver_ = writer_->steps();
        throw;
    }
}

std::string RunFolder::writeFrame(const Simulation& simulation, int frame)
{
    open();
    std::shared_ptr<FrameData> data;  // shared, since jobs are copyable
    {
        const StageTimer timer(work_, "snapshot");
        data = std::make_shared<FrameData>(takeFrame(simulation, scene_, frame));
    }
    if (isDrawn(scene_.output)) {
        const StageTimer timer(work_, "draw");
        drawing_->follow(simulation, work_);
        data->drawn = drawing_->frame(simulation);
        for (const DrawnBody& body : data->drawn) work_.count("draw", "moved_points", body.moved);
        data->record.drawn = boundsOf(data->drawn), data->record.squeeze = squeezeOf(data->drawn);
    }
    const std::string hash = data->record.stateHash;
    data->steps = newSteps();  // last: where something failed they are still to be written
    handOver([writer = writer_.get(), data = std::move(data)] { writer->write(*data); });
    return hash;
}

void RunFolder::writeCheckpoint(const Simulation& simulation, const std::string& settings)
{
    if (simulation.steps() == checkpointed_) return;
    open();
    checkpointed_ = simulation.steps();
    const std::string hash = hexadecimal(simulation.stateHash());
    if (simulation.steps() == 0) restHash_ = hash, bodiesHash_ = hexadecimal(simulation.bodiesHash());
    auto archive = std::make_shared<Archive>();
    {
        const StageTimer timer(work_, "snapshot");
        archive->putText("creator", kCreator);
        archive->putText("settings", settings);
        archive->putText("rest_hash", restHash_);
        archive->putText("bodies_hash", bodiesHash_);
        archive->putText("body_files_hash", bodyFilesHash_);
        archive->putText("colliders_hash", collidersHash_);
        archive->putText("branches", branchesJson(branches_).dump());
        archive->putText("state_hash", hash);
        simulation.save(*archive);
    }
    handOver([writer = writer_.get(), archive = std::move(archive), steps = newSteps()] {
        writer->writeCheckpoint(*archive, steps);
    });
}

/// A checkpoint of a run, and what belongs to it.
struct RunFolder::Found {
    fs::path run, file;
    Archive archive;
    RecordLog::Records records;
};

/// The newest whole one that `how` allows; none where there is neither a checkpoint nor a frame.
std::optional<RunFolder::Found> RunFolder::newestIn(const fs::path& run, const Resume& how,
                                                    std::vector<std::string>& notes)
{
    if (const int first = scene_.time.firstFrame; how.lastFrame < first)
        throw InputError({run.string(), "has no frame " + std::to_string(how.lastFrame) + " to go on from",
                          "frames from " + std::to_string(first) + " on", ""});
    std::vector<fs::path> checkpoints = checkpointsIn(run);
    if (checkpoints.empty()) {
        if (!hasFrames(run)) return {};
        throw FileError(run.string(),
                        "holds frames but no checkpoint; use --overwrite to start again, or another folder");
    }
    std::string passed, later;
    for (std::reverse(checkpoints.begin(), checkpoints.end()); const fs::path& file : checkpoints) {
        Found found{run, file, {}, {}};
        try {
            found.archive = Archive::read(file, how.memoryLimit);
            const bool isOwn = run == folder_ && file.stem().stem() == scene_.name;
            found.records = isOwn ? writer_->readRecords(found.archive) : recordsOf(file, found.archive);
        } catch (const FileError& e) {
            passed += std::string("; ") + e.what();
            continue;
        }
        if (const auto& frames = found.records.frames; !frames.empty() && frames.back().frame > how.lastFrame) {
            const std::string there = std::to_string(frames.back().frame), asked = std::to_string(how.lastFrame);
            if (later = "; the first is of frame " + there; how.mayBranch) continue;
            throw InputError({"--resume", "the run has frames up to " + there + ", the scene ends at " + asked,
                              "frames up to " + there + " or later",
                              "--resume=" + asked + " goes back, and removes the frames behind"});
        }
        if (!passed.empty()) notes.push_back("an older checkpoint is taken" + passed);
        return found;
    }
    throw FileError((run / kCheckpointFolder).string(),
                    "has no whole checkpoint up to frame " + std::to_string(how.lastFrame) + later +
                        " (with --keep-checkpoints a run keeps all that it writes)" + passed);
}

void verifyCheckpoint(const fs::path& file, std::uint64_t memoryLimit)
{
    recordsOf(file, Archive::read(file, memoryLimit));
}

bool RunFolder::resume(Simulation& simulation, const Resume& how, std::vector<std::string>& notes)
{
    if (!fs::exists(folder_ / kManifest) && checkpointsIn(folder_).empty()) return false;  // no run has been here
    std::optional<Found> found = newestIn(folder_, how, notes);
    if (!found) return false;
    goOn(simulation, how, *found, notes);
    lostFiles_ = core::lostFiles(folder_, found->records.frames);
    if (!lostFiles_.empty()) notes.push_back(lostFiles_);
    if (mayKeepCheckpoints(folder_)) keepCheckpoints();
    open();
    writer_->goOnFrom(found->file.filename(), std::move(found->records));
    if (how.mayBranch) writer_->removeLater(found->file.filename());
    return true;
}

bool RunFolder::branchFrom(const fs::path& run, Simulation& simulation, const Resume& how,
                           std::vector<std::string>& notes)
{
    if (std::error_code none; fs::equivalent(run, folder_, none))
        throw InputError({"--branch", "is the folder that the branch would be written into: " + run.string(),
                          "another folder for the branch", "--resume=FRAME goes on in the same folder"});
    std::optional<Found> found = newestIn(run, how, notes);
    if (!found) return false;
    goOn(simulation, how, *found, notes);
    open();
    writer_->takeOver(run, std::move(found->records));
    return true;
}

void RunFolder::goOn(Simulation& simulation, const Resume& how, const Found& found, std::vector<std::string>& notes)
{
    const Archive& archive = found.archive;
    const auto refuse = [](const std::string& what) {
        throw InputError({"--resume", what, "", "start again with --overwrite, or in another folder"});
    };
    if (const std::string creator = archive.getText("creator"); creator != kCreator)
        refuse("the run was made by " + creator + ", this is " + kCreator);
    if (!how.mayBranch) requireSame(how.settings, archive.getText("settings"));
    Branch branch = branchBetween(archive.getText("settings"), how.settings);
    restHash_ = hexadecimal(simulation.stateHash()), bodiesHash_ = hexadecimal(simulation.bodiesHash());
    if (!branch.isFiner && bodiesHash_ != archive.getText("bodies_hash"))
        refuse("the bodies at rest are not those of the run: a mesh, a .vdb file or the program has changed since");
    if (const std::string before = archive.getText("colliders_hash"); before != collidersHash_) {
        if (!how.mayBranch) refuse("the colliders are not those of the run: a mesh or a .vdb file has changed since");
        branch.changes.push_back({"hash of the files of colliders", before, collidersHash_});
    }
    const bool isBranch = !branch.changes.empty();
    if (!isBranch && restHash_ != archive.getText("rest_hash"))
        refuse("the start is not that of the run: the program has changed since");
    if (archive.has("body_files_hash") && bodyFilesHash_ != archive.getText("body_files_hash"))
        notes.push_back("a mesh has changed since, if not its shape: frames from here on are drawn by it as it is now");
    takeState(simulation, how, archive, branch, notes);
    const auto& frames = found.records.frames;
    steps_ = found.records.steps;
    bool sound = int(steps_.size()) == simulation.steps() && int(frames.size()) <= simulation.framesDone() + 1;
    for (std::size_t i = 0; i < frames.size(); ++i) sound = sound && frames[i].frame == scene_.time.firstFrame + int(i);
    if (!sound) archive.complain("its steps and frames do not match");
    handedOver_ = steps_.size();
    branches_ = branchesOf(archive);
    if (isBranch || found.run != folder_) noteBranch(branch, found, simulation, notes);
    checkpointed_ = isBranch || found.run != folder_ ? -1 : simulation.steps();
    writer_->setBranches(branches_);
}

void RunFolder::takeState(Simulation& simulation, const Resume& how, const Archive& archive, const Branch& branch,
                          std::vector<std::string>& notes)
{
    if (isDrawnOtherwiseOnly(branch)) {
        simulation.restoreFrom(archive);
        if (archive.getText("state_hash") != hexadecimal(simulation.stateHash()))
            archive.complain("the state it leads to is not the one that was saved");
        return;
    }
    if (!branch.isFiner) return simulation.branchFrom(archive);
    if (simulation.ancestry())
        throw InputError({"output.motion, output.point_cache", "nodes cannot be followed to a finer lattice", "",
                          "--set output.motion=false --set output.point_cache=[]"});
    Simulation& wide = how.wider();
    if (hexadecimal(wide.bodiesHash()) != archive.getText("bodies_hash"))
        throw InputError({"--resume", "the bodies with voxels twice as wide are not those of the run", "", ""});
    wide.branchFrom(archive);
    simulation.refineFrom(wide, archive);
    const Simulation::Totals before = wide.totals(), now = simulation.totals();
    const auto told = [](const std::string& what, double from, double to, const char* unit) {
        const double percent = from != 0 ? 100 * (to / from - 1) : 0;
        return what + " " + shortNumber(to, 6) + unit + ", was " + shortNumber(from, 6) + " (" +
               (percent < 0 ? "" : "+") + shortNumber(percent, 2) + " %); ";
    };
    notes.push_back("on the finer lattice: " + told("volume", before.volume, now.volume, " m^3") +
                    told("elastic energy", before.elasticEnergy, now.elasticEnergy, " J") +
                    told("kinetic energy", before.kineticEnergy, now.kineticEnergy, " J") +
                    counted(simulation.fragments(), "fragment") + ", was " + std::to_string(wide.fragments()));
}

void RunFolder::noteBranch(const Branch& branch, const Found& found, const Simulation& simulation,
                           std::vector<std::string>& notes)
{
    const auto& frames = found.records.frames;
    const int last = frames.empty() ? scene_.time.firstFrame - 1 : frames.back().frame;
    const bool other = found.run != folder_;
    branches_.push_back({last, simulation.steps(), other ? found.run.string() : "", branch.changes});
    notes.push_back((frames.empty() ? "branches at the start" : "branches after frame " + std::to_string(last)) +
                    (other ? " of " + found.run.string() : "") +
                    (branch.changes.empty() ? "; nothing is changed" : ":"));
    for (const scene::Change& change : branch.changes) notes.push_back("  " + changeText(change));
    if (simulation.ancestry() && !simulation.stages().draw.empty() && hasOtherColliders(branch))
        notes.push_back("a point cache is drawn against these colliders in the frames before the branch too");
}

void RunFolder::keepCheckpoints() { writer_->keepCheckpoints(); }

void RunFolder::writePointCache(const Simulation& simulation)
{
    if (scene_.output.pointCache.empty()) return;
    const auto drawing = std::make_shared<Drawing>(*drawing_);
    {
        const StageTimer timer(work_, "draw");
        drawing->followWhole(simulation, work_);
    }
    handOver([this, &simulation, drawing] { writer_->writePointCache(simulation, *drawing); });
}

void RunFolder::finish(const Simulation& simulation, const std::string& status, const std::string& error)
{
    handOver([writer = writer_.get(), steps = newSteps(), state = runState(simulation), status, error] {
        writer->writeTables(steps, state, status, error);
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
