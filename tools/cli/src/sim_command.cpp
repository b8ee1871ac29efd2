// vdbfrac sim: a scene in, frames out.
#include "accuracy.h"
#include "options.h"
#include "progress.h"
#include "report_files.h"
#include "run_report.h"
#include "sim_plan.h"
#include "step_warnings.h"
#include "stop_request.h"
#include <vdbfrac/lab/study/study_table.h>

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/cli/commands.h>
#include <vdbfrac/cli/frame_list.h>
#include <vdbfrac/core/run_folder.h>
#include <vdbfrac/core/version.h>
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/lab/scenes/patience.h>
#include <vdbfrac/lab/scenes/prepared_scene.h>
#include <vdbfrac/lab/machine/memory.h>
#include <vdbfrac/lab/machine/process.h>
#include <vdbfrac/report/run_frames.h>
#include <vdbfrac/scene/reader.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

namespace vdbfrac::cli {

namespace {

constexpr int kMaxFrame = 999999;  // as scenes have it

struct SimOptions {
    CommonOptions common;
    std::string scene, folder, frames, accuracy, timeLimit;
    std::string resume;     // empty: no; "latest"; or the last frame to keep
    std::string branch;     // folder of the run that this one branches from
    std::optional<int> at;  // the last frame to keep of it; none: its newest
    std::vector<std::string> set;
    bool overwrite = false, plan = false, strict = false, report = false, keepCheckpoints = false;
    int threads = 0, checkpointEvery = 1, parent = 0;
    double maxMemory = 0;    // GiB; 0: 80 % of what is available
    double measureFor = 10;  // s
};

/// "A-B" or "B" (from the scene's first frame).
void limitFrames(scene::Scene& scene, const std::string& text)
{
    if (text.empty()) return;
    const std::size_t dash = text.find('-');
    const bool isRange = dash != std::string::npos;
    const std::optional<int> first = isRange ? parseFrame(text.substr(0, dash)) : scene.time.firstFrame,
                             last = parseFrame(isRange ? text.substr(dash + 1) : text);
    if (first != scene.time.firstFrame || !last || *last < *first || *last > kMaxFrame)
        throw InputError({"--frames", "'" + text + "' is not a frame range of this scene",
                          std::to_string(scene.time.firstFrame) + "-LAST, or LAST, up to " + std::to_string(kMaxFrame),
                          "a simulation starts at the scene's first frame"});
    scene.time.lastFrame = *last;
}

/// The last frame that a resumed run keeps, of one up to `last`.
int lastToKeep(const std::string& resume, int last)
{
    const std::optional<int> frame = resume == "latest" ? last : parseFrame(resume);
    if (!frame || *frame > last)
        throw InputError({"--resume", "'" + resume + "' is not a frame of the scene",
                          "--resume, or --resume=FRAME up to " + std::to_string(last), ""});
    return *frame;
}

/// What the steps of a run depend on, as text: the scene, but for its last frame and the folders that files lie in.
/// What is in the files is compared on its own: as the bodies at rest, and as it is for colliders.
std::string settingsText(scene::Scene scene)
{
    scene.notes.clear();  // of studies and wedges
    scene.time.lastFrame = scene.time.firstFrame;
    const auto leaveOutFolder = [](scene::Shape& shape) {  // absolute, so that the text does not depend on where we are
        if (std::filesystem::path* file = scene::fileOf(shape)) *file = "/" / file->filename();
    };
    for (scene::Body& body : scene.bodies) leaveOutFolder(body.shape);
    for (scene::Collider& collider : scene.colliders) leaveOutFolder(collider.shape);
    return scene::writeScene(scene, lab::study::vocabulary());
}

constexpr const char* kStuck = "stuck";  // why a run was stopped, beside signals and time limits

/// A run on its way from one frame to the next.
class Run {
public:
    Run(const SimOptions& options, const scene::Scene& scene, core::Simulation& simulation, spdlog::logger& log)
        : options_(options),
          scene_(scene),
          settings_(settingsText(scene)),
          simulation_(simulation),
          log_(log),
          folder_(options.folder, scene, simulation,
                  !options.resume.empty() ? core::ExistingRun::keep
                  : options.overwrite     ? core::ExistingRun::replace
                                          : core::ExistingRun::refuse),
          lastWritten_(scene.time.firstFrame - 1),
          warnings_(scene, {simulation.startVolume(), core::energyOfNoise(simulation.bodies())}, log)
    {
        if (options.report) report_.emplace(folder_.path());
        if (options.keepCheckpoints) folder_.keepCheckpoints();
    }

    void begin();
    /// Returns why it stopped before the last frame; empty when it did not.
    std::string toLastFrame(const StopRequest& stop);
    int end(const std::string& stopped);
    /// Keeps the steps up to an error: they tell what led to it.
    void fail(const std::string& error);

private:
    bool takeUp(std::vector<std::string>& notes);
    std::string toFrame(int frame, const StopRequest& stop, Progress& progress);
    void tellOfReport(const std::string& wrong) const
    {
        if (!wrong.empty()) log_.warn("report.html: {}", wrong);
    }
    void writeOwnScene() const;

    const SimOptions& options_;
    const scene::Scene& scene_;
    std::string settings_;
    core::Simulation& simulation_;
    spdlog::logger& log_;
    core::RunFolder folder_;
    int lastWritten_;  // frame
    std::optional<LiveReport> report_;
    StepWarnings warnings_;
};

/// Goes on with an earlier run, this one or another, where that is asked for and there is one.
bool Run::takeUp(std::vector<std::string>& notes)
{
    std::optional<lab::PreparedScene> wider;
    const std::uint64_t memory = memoryLimitOf(options_.maxMemory);
    const std::function<core::Simulation&()> twiceAsWide = [&]() -> core::Simulation& {
        scene::Scene scene = scene_;
        scene.grid.voxelSize *= 2;
        return wider.emplace(std::move(scene), memory).simulation;
    };
    core::Resume how{settings_, scene_.time.lastFrame, memory, false, twiceAsWide};
    if (!options_.resume.empty()) {
        core::Resume own = how;
        own.lastFrame = lastToKeep(options_.resume, scene_.time.lastFrame);
        own.mayBranch = options_.resume != "latest";
        if (folder_.resume(simulation_, own, notes)) return true;
    }
    if (options_.branch.empty()) return false;
    if (options_.at)
        how.lastFrame = std::min(report::frameWithin(options_.branch, *options_.at, "--at"), how.lastFrame);
    how.mayBranch = true;
    if (folder_.branchFrom(options_.branch, simulation_, how, notes)) return true;
    throw FileError(options_.branch, "holds no run to branch from");
}

/// Goes on with an earlier run where that is asked for, and says what runs.
void Run::begin()
{
    std::vector<std::string> notes = effects::notesOf(scene_);
    notes.insert(notes.end(), folder_.notes().begin(), folder_.notes().end());
    const bool resumed = takeUp(notes);
    notes.insert(notes.end(), simulation_.stages().notes.begin(), simulation_.stages().notes.end());
    if (resumed) lastWritten_ += int(folder_.frames().size()), warnings_.takeUp(folder_.steps());
    folder_.writeCheckpoint(simulation_, settings_);  // from here on there is always one of these settings
    writeOwnScene();
    logToFile(log_, folder_.path() / "run.log");
    log_.info("vdbfrac {}  scene '{}'  {} nodes  {} tets  {}", core::kVersion, scene_.name, simulation_.x().size(),
              simulation_.elastic().tetCount(), counted(threadCount(), "thread"));
    if (resumed && lastWritten_ >= scene_.time.lastFrame)
        log_.info("resumes after step {}, {:.6g} s: nothing is left to do, all frames to {} are there",
                  simulation_.steps(), simulation_.time(), lastWritten_);
    else if (resumed)
        log_.info("resumes after step {}, {:.6g} s, with frame {}", simulation_.steps(), simulation_.time(),
                  lastWritten_ + 1);
    else if (!options_.resume.empty())
        log_.info("there is no run yet: starts at frame {}", scene_.time.firstFrame);
    if (!options_.accuracy.empty()) log_.info("{}", accuracyText(scene_, options_.accuracy));
    for (const std::string& note : notes) log_.warn("note: {}", note);
}

/// The scene of the run, beside its frames. Where the user gave that very file, it stays as it is unless steps would
/// be others by it.
void Run::writeOwnScene() const
{
    const auto vocabulary = lab::study::vocabulary();
    const std::filesystem::path own = folder_.path() / "scene.toml";
    std::error_code none;
    if (std::filesystem::equivalent(own, scene_.file, none) &&
        settingsText(scene::readScene(own, vocabulary)) == settings_)
        return;
    writeText(own, scene::writeScene(scene_, vocabulary));
}

std::string Run::toFrame(int frame, const StopRequest& stop, Progress& progress)
{
    const int first = scene_.time.firstFrame;
    const double start = (frame - 1 - first) / scene_.time.fps;
    lab::Patience patience;
    const auto isDone = [&] { return simulation_.framesDone() >= frame - first; };
    while (!isDone()) {
        const core::StepRecord step = simulation_.stepInFrame();
        folder_.addStep(step);
        log_.debug("{}", stepText(step));
        warnings_.see(step);
        progress.update(frame - first + (simulation_.time() - start) * scene_.time.fps, stepText(step));
        if (isDone()) break;  // what the last step leaves for the frame alone is in no checkpoint
        if (patience.isOver(step, simulation_.framesDone())) return kStuck;
        if (const std::string reason = stop.reason(); !reason.empty()) return reason;  // after a step: each try gets on
    }
    return "";
}

std::string Run::toLastFrame(const StopRequest& stop)
{
    const int first = scene_.time.firstFrame, last = scene_.time.lastFrame;
    Progress progress(options_.common.progressKind(), last - first + 1, lastWritten_ + 1 - first);
    for (int frame = lastWritten_ + 1; frame <= last; ++frame) {
        if (const std::string reason = toFrame(frame, stop, progress); !reason.empty()) return reason;
        log_.debug("frame {}  state {}", frame, folder_.writeFrame(simulation_, frame));
        lastWritten_ = frame;
        const int every = options_.checkpointEvery;
        if ((every > 0 && (frame - first) % every == 0) || frame == last)
            folder_.writeCheckpoint(simulation_, settings_);
        progress.frame(
            frame, frame - first + 1,
            std::to_string(simulation_.fragments()) + (simulation_.fragments() == 1 ? " fragment" : " fragments"));
        if (frame == last) break;
        if (const std::string reason = stop.reason(); !reason.empty() && frame > first) return reason;
        if (report_) tellOfReport(report_->update());
    }
    return "";
}

int Run::end(const std::string& stopped)
{
    if (stopped.empty())
        folder_.writePointCache(simulation_);
    else
        folder_.writeCheckpoint(simulation_, settings_);
    const bool capped = anyCapped(folder_.steps());
    folder_.finish(simulation_, stopped == kStuck  ? "stuck"
                                : !stopped.empty() ? "stopped"
                                : capped           ? "done, not converged everywhere"
                                                   : "done");
    Ledger work = folder_.work();
    for (const core::StepRecord& step : folder_.steps()) work.add(step.work);
    log_.info("{}", summaryText(scene_, simulation_, folder_, work));
    if (report_) tellOfReport(report_->finish());
    if (!stopped.empty()) {
        if (stopped == kStuck) {
            log_.error(
                "frame {} gets nowhere: too many of its steps were cut back or not solved, the last to {:.2g} s{}. "
                "What may help: slower grips, [volume] for what is squeezed or twisted, [damping] stiffness, a looser "
                "solver.newton_tolerance (0.02), shorter steps of an explicit integrator (time.substeps), a smaller "
                "poisson_ratio, another voxel_size; with a checkpoint it stops here, --resume tries on",
                lastWritten_ + 1, folder_.steps().back().dt, unsolvedPlace(folder_.steps().back()));
            return kNotConverged;
        }
        log_.warn("stopped by {} after step {}, {:.6g} s, frame {}; continue with --resume", stopped,
                  simulation_.steps(), simulation_.time(), lastWritten_);
        return kStopped;
    }
    if (!folder_.lostFiles().empty()) {
        log_.error("{}", folder_.lostFiles());
        return kBadFile;
    }
    return capped && options_.strict ? kNotConverged : kDone;
}

void Run::fail(const std::string& error)
{
    if (!folder_.isOpen()) return;
    const auto& sinks = log_.sinks();  // the first is stderr, where the caller tells it
    spdlog::logger("", sinks.begin() + 1, sinks.end()).error("failed: {}", error);
    try {
        folder_.finish(simulation_, "failed", error);
    } catch (const std::exception& e) {  // of the two the first is told
        log_.debug("the last steps are not in stats.csv: {}", e.what());
    }
}

int simulate(const SimOptions& options, const scene::Scene& scene)
{
    const auto start = std::chrono::steady_clock::now();
    const double timeLimit = options.timeLimit.empty() ? INFINITY : parseDuration("--time-limit", options.timeLimit);
    const auto log = makeLog(options.common);
    const std::uint64_t limit = memoryLimitOf(options.maxMemory);
    const core::SceneEstimate estimate = core::estimateScene(scene, limit, effects::bytesPerTet(scene));
    if (options.plan) {
        printPlan(scene, estimate, options.accuracy,
                  {options.measureFor, limit, options.keepCheckpoints, options.checkpointEvery});
        return kDone;
    }
    core::requireMemory(estimate, limit);
    lab::PreparedScene prepared(scene, limit);
    Run run(options, scene, prepared.simulation, *log);
    try {
        run.begin();
        const StopRequest stop(start, timeLimit);
        return run.end(run.toLastFrame(stop));
    } catch (const std::exception& e) {
        run.fail(dynamic_cast<const std::bad_alloc*>(&e) ? kOutOfMemory : e.what());
        throw;
    }
}

}  // namespace

Action addSim(CLI::App& app)
{
    auto o = std::make_shared<SimOptions>();
    CLI::App* c = app.add_subcommand("sim", "Simulate a scene and write its frames");
    c->add_option("SCENE", o->scene, "Scene file (TOML)")->required();
    auto* folder = c->add_option("-o,--output", o->folder, "Folder for the frames")->type_name("DIR");
    c->add_option("-f,--frames", o->frames, "Frames to simulate: FIRST-LAST or LAST (default: the scene's)");
    auto* overwrite = c->add_flag("--overwrite", o->overwrite, "Replace an earlier run in the folder");
    c->add_flag("--resume{latest}", o->resume,
                "Go on with the run in the folder from its newest checkpoint, or with --resume=FRAME from the newest "
                "up to that frame, also with other settings; starts where no run is yet")
        ->excludes(overwrite);
    auto* branch =
        c->add_option("--branch", o->branch,
                      "If the output folder holds no run: start from a checkpoint of this other run, with other "
                      "settings; its frames up to there are copied")
            ->type_name("RUN");
    c->add_option("--at", o->at, "With --branch: the last frame to keep of the other run (default: its newest)")
        ->type_name("FRAME")
        ->needs(branch);
    c->add_flag("--keep-checkpoints", o->keepCheckpoints,
                "Keep all checkpoints, so that any can be branched from; else the last two");
    c->add_option(
         "--checkpoint-every", o->checkpointEvery,
         "Frames from one checkpoint to the next; 0: only at the start, at the end, and when the run is stopped")
        ->check(CLI::Range(0, kMaxFrame))
        ->capture_default_str();
    c->add_option("--time-limit", o->timeLimit,
                  "Stop, with a checkpoint, once this much wall time has passed, as 3h50m (exit code 75)")
        ->type_name("TIME");
    addThreads(*c, o->threads);
    addSet(*c, o->set, "Change a key of the scene: key=value, as in grid.voxel_size=0.02");
    c->add_option(
         "--accuracy", o->accuracy,
         "Make voxels, time steps and tolerance coarser or finer than the scene says, and print the expected errors")
        ->check(CLI::IsMember(accuracyLevels()));
    auto* plan = c->add_flag("-n,--plan", o->plan,
                             "Only say what would run: sizes, memory, the stages and why the others are off, files; "
                             "then time and disk, measured on this machine");
    c->add_option("--measure", o->measureFor,
                  "With --plan: about how many seconds to measure time and disk for; 0 skips it")
        ->check(CLI::Range(0., 3600.))
        ->type_name("SECONDS")
        ->needs(plan)
        ->capture_default_str();
    c->add_flag("--report", o->report, "Keep a page on the run in DIR/report.html, also while it goes on");
    c->add_flag("--strict", o->strict, "Exit with 3 when a step did not converge");
    addMaxMemory(*c, o->maxMemory, "the run");
    c->add_option("--parent", o->parent)->group("");  // of runs that a wedge starts; hidden
    addCommonOptions(*c, o->common);
    return [o, folder, plan] {
        if (!o->resume.empty()) leaveOnSignals();
        if (o->parent > 0) lab::endWithParent(o->parent);
        if (folder->count() == 0 && plan->count() == 0)
            throw InputError({"vdbfrac sim", "no output folder", "-o DIR", "or -n to see what would run"});
        scene::Scene scene = scene::readScene(o->scene, lab::study::vocabulary(), o->set);
        limitFrames(scene, o->frames);
        if (!o->accuracy.empty()) setAccuracy(scene, o->accuracy);
        const ThreadLimit threads(o->threads);
        return simulate(*o, scene);
    };
}

}  // namespace vdbfrac::cli
