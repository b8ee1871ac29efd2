#include <vdbfrac/core/run_folder.h>

#include "frame_writer.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/tetmesh/obj_file.h>

#include <algorithm>

namespace vdbfrac::core {

namespace fs = std::filesystem;

namespace {

/// Frames that may wait for the writer: with the one it is at, and one that is handed over, three are in memory at most.
constexpr std::size_t kWaitingFrames = 1;

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

}  // namespace

RunFolder::RunFolder(fs::path folder, const scene::Scene& scene, const Stages& stages, bool overwrite)
    : folder_(std::move(folder)), scene_(scene), writer_(std::make_unique<Writer>(folder_, scene)), queue_(kWaitingFrames)
{
    requireSources(scene, stages);
    prepare(folder_, overwrite);
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
