// vdbfrac sim: a scene in, frames out.
#include "accuracy.h"
#include "common.h"
#include "memory.h"
#include "progress.h"
#include "run_report.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/core/run_folder.h>
#include <vdbfrac/core/version.h>
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/scene/reader.h>

#include <cmath>
#include <cstdio>

namespace vdbfrac::tools {

namespace {

struct SimOptions {
    CommonOptions common;
    std::string scene, folder, frames, accuracy;
    std::vector<std::string> set;
    bool overwrite = false, plan = false, strict = false;
    int threads = 0;
    double maxMemory = 0;  // GiB; 0: 80 % of what is available
};

/// "A-B" or "B" (from the scene's first frame).
void limitFrames(scene::Scene& scene, const std::string& text)
{
    if (text.empty()) return;
    int first = scene.time.firstFrame, last = 0;
    char rest = 0;
    const bool range = std::sscanf(text.c_str(), "%d-%d%c", &first, &last, &rest) == 2;
    const bool single = !range && std::sscanf(text.c_str(), "%d%c", &last, &rest) == 1;
    if (single) first = scene.time.firstFrame;
    if (!(range || single) || first != scene.time.firstFrame || last < first)
        throw InputError({"--frames", "'" + text + "' is not a frame range of this scene",
                          std::to_string(scene.time.firstFrame) + "-LAST, or LAST",
                          "a simulation starts at the scene's first frame"});
    scene.time.lastFrame = last;
}

std::vector<core::Effect*> pointers(const std::vector<std::unique_ptr<core::Effect>>& effects)
{
    std::vector<core::Effect*> p;
    for (const auto& e : effects) p.push_back(e.get());
    return p;
}

void requireMemory(const core::Simulation& simulation, std::uint64_t limit)
{
    const std::uint64_t estimate = core::estimateMemory(simulation);
    if (estimate <= limit) return;
    char text[160];
    std::snprintf(text, sizeof text, "the run needs about %.2f GiB, the limit is %.2f GiB; use a coarser grid.voxel_size or --max-memory",
                  double(estimate) / kGiB, double(limit) / kGiB);
    throw LimitError(text);
}

int simulate(const SimOptions& options, const scene::Scene& scene)
{
    const auto log = makeLog(options.common);
    const std::uint64_t limit = options.maxMemory > 0 ? std::uint64_t(options.maxMemory * kGiB) : defaultMemoryLimit();
    const auto effects = effects::makeEffects(scene);
    core::Simulation simulation(scene, pointers(effects), limit);
    if (options.plan) {
        if (!options.accuracy.empty()) std::printf("%s\n", accuracyText(scene, options.accuracy).c_str());
        std::fputs(planText(scene, simulation).c_str(), stdout);
        return kDone;
    }
    requireMemory(simulation, limit);
    core::RunFolder folder(options.folder, scene, simulation.stages(), options.overwrite);
    writeText(folder.path() / "scene.toml", scene::writeScene(scene, effects::effectTables()));
    logToFile(*log, folder.path() / "run.log");
    log->info("vdbfrac {}  scene '{}'  {} nodes  {} tets  {} threads", core::kVersion, scene.name, simulation.x().size(),
              simulation.elastic().tetCount(), threadCount());
    if (!options.accuracy.empty()) log->info("{}", accuracyText(scene, options.accuracy));
    for (const std::string& note : simulation.stages().notes) log->warn("note: {}", note);

    Ledger work;
    const int first = scene.time.firstFrame, last = scene.time.lastFrame;
    {
        Progress progress(options.common.quiet ? "none" : options.common.progress, last - first + 1);
        for (int frame = first; frame <= last; ++frame) {
            const double end = (frame - first) / scene.time.fps;
            const double start = simulation.time();
            while (simulation.framesDone() < frame - first) {
                const core::StepRecord step = simulation.stepInFrame();
                work.add(step.work);
                folder.addStep(step);
                log->debug("{}", stepText(step));
                if (step.outcome == core::Outcome::capped)
                    log->warn("step {}: the solver hit its caps (relative residual {:.2g}, of the best iterate {:.2g}); the last iterate was kept",
                              step.step, step.residual, step.leastResidual);
                progress.update(frame - first + (simulation.time() - start) / (end - start), stepText(step));
            }
            log->debug("frame {}  state {}", frame, folder.writeFrame(simulation, frame));
            progress.frame(frame, frame - first + 1,
                           std::to_string(simulation.fragments()) + (simulation.fragments() == 1 ? " fragment" : " fragments"));
        }
    }
    const bool capped = anyCapped(folder.steps());
    folder.finish(simulation, capped ? "done, not converged everywhere" : "done");
    work.add(folder.work());
    log->info("{}", summaryText(simulation, folder, work));
    return capped && options.strict ? kNotConverged : kDone;
}

}  // namespace

Action addSim(CLI::App& app)
{
    auto o = std::make_shared<SimOptions>();
    CLI::App* c = app.add_subcommand("sim", "Simulate a scene and write its frames");
    c->add_option("SCENE", o->scene, "Scene file (TOML)")->required();
    auto* folder = c->add_option("-o,--output", o->folder, "Folder for the frames")->type_name("DIR");
    c->add_option("-f,--frames", o->frames, "Frames to simulate: FIRST-LAST or LAST (default: the scene's)");
    c->add_flag("--overwrite", o->overwrite, "Replace an earlier run in the folder");
    c->add_option("-j,--threads", o->threads, "Threads to use (default: all cores)")->check(CLI::NonNegativeNumber);
    c->add_option("--set", o->set, "Change a key of the scene: key=value, as in grid.voxel_size=0.02")->type_name("KEY=VALUE");
    c->add_option("--accuracy", o->accuracy,
                  "Make voxels, time steps and tolerance coarser or finer than the scene says, and say what to expect of it")
        ->check(CLI::IsMember(accuracyLevels()));
    auto* plan = c->add_flag("-n,--plan", o->plan, "Only say what would run: sizes, memory, the stages and why the others are off");
    c->add_flag("--strict", o->strict, "Exit with 3 when a step did not converge");
    c->add_option("--max-memory", o->maxMemory, "GiB the run may use (default: 80 % of what is available)")->check(CLI::PositiveNumber);
    addCommonOptions(*c, o->common);
    return [o, folder, plan] {
        if (folder->count() == 0 && plan->count() == 0)
            throw InputError({"vdbfrac sim", "no output folder", "-o DIR", "or -n to see what would run"});
        scene::Scene scene = scene::readScene(o->scene, effects::effectTables(), o->set);
        limitFrames(scene, o->frames);
        if (!o->accuracy.empty()) setAccuracy(scene, o->accuracy);
        const ThreadLimit threads(o->threads);
        return simulate(*o, scene);
    };
}

}  // namespace vdbfrac::tools
