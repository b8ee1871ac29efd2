// vdbfrac wedge: a scene with many settings, here or on a cluster.
#include "options.h"
#include "report_files.h"
#include "slurm_options.h"
#include "stop_request.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/cli/commands.h>
#include <vdbfrac/core/estimate.h>
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/farm/local.h>
#include <vdbfrac/farm/slurm.h>
#include <vdbfrac/farm/wedge.h>
#include <vdbfrac/lab/machine/memory.h>
#include <vdbfrac/lab/machine/process.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <thread>

namespace vdbfrac::cli {

namespace fs = std::filesystem;

namespace {

struct WedgeOptions {
    CommonOptions common;
    farm::WedgeInput input;
    std::string folder;
    SlurmOptions slurm;
    bool list = false, prepare = false, local = false, collect = false;
    int run = -1;
    int sideBySide = 0, threads = 0;  // 0: as the cores allow
    std::vector<std::string> sim;
};

int cores() { return int(std::max(1u, std::thread::hardware_concurrency())); }

int list(const farm::WedgePlan& plan)
{
    std::string head = "run ";
    for (const std::string& key : plan.wedge.keys) head += fmt::format("  {:>24}", key);
    std::printf("%s  %10s  %10s\n", head.c_str(), "about nodes", "GiB");
    for (std::size_t r = 0; r < plan.scenes.size(); ++r) {
        const core::SceneEstimate e =
            core::estimateScene(plan.scenes[r], lab::defaultMemoryLimit(), effects::bytesPerTet(plan.scenes[r]));
        std::string row = plan.wedge.runs[r].name;
        for (const std::string& value : plan.wedge.runs[r].values) row += fmt::format("  {:>24}", value);
        std::printf("%s  %10.0f  %10.2f\n", row.c_str(), e.nodes, e.bytes / lab::kGiB);
    }
    return kDone;
}

/// Absolute, since tasks may begin elsewhere.
fs::path folderOf(const WedgeOptions& o, const std::string& name)
{
    return fs::absolute(o.folder.empty() ? "wedge_" + name : o.folder).lexically_normal();
}

farm::LocalSettings settingsOf(const WedgeOptions& o, const fs::path& folder, const StopRequest& stop)
{
    farm::LocalSettings s;
    s.folder = folder;
    s.sideBySide = o.sideBySide > 0 ? o.sideBySide : 1;
    s.threads = o.threads > 0 ? o.threads : std::max(1, cores() / s.sideBySide);
    s.arguments = o.sim;
    s.arguments.push_back("--report");
    s.stop = [&stop] {
        const std::string reason = stop.reason();
        return reason.empty() ? 0 : reason == "SIGUSR1" ? SIGUSR1 : SIGTERM;
    };
    return s;
}

int runLocal(const WedgeOptions& o, farm::WedgePlan plan)
{
    const auto log = makeLog(o.common);
    const fs::path folder = folderOf(o, plan.wedge.name);
    farm::layOut(plan, folder);
    int code = kDone;
    {
        const StopRequest stop(std::chrono::steady_clock::now(), INFINITY);
        farm::LocalSettings settings = settingsOf(o, folder, stop);
        settings.say = [&](const std::string& line) { log->info("{}", line); };
        log->info("{}, {} at a time on {} each, in {}", counted(plan.wedge.runs.size(), "run"), settings.sideBySide,
                  counted(settings.threads, "thread"), folder.string());
        code = farm::runHere(plan.wedge, settings);
    }
    log->info("written to {}", writeReport(folder).string());
    return code;
}

int runOnSlurm(const WedgeOptions& o, farm::WedgePlan plan)
{
    const fs::path folder = folderOf(o, plan.wedge.name);
    farm::layOut(plan, folder);
    const std::string program = lab::ownProgram().string();
    farm::SlurmJob job;
    job.name = plan.wedge.name;
    for (std::size_t r = 0; r < plan.wedge.runs.size(); ++r)
        if (!farm::isDone(farm::statusOf(folder, plan.wedge.runs[r]))) job.tasks.push_back(r);
    if (job.tasks.empty()) {
        std::printf("all runs are done\n");
        return kDone;
    }
    job.threads = o.threads > 0 ? o.threads : 1;
    job.command = {program, "wedge", "--output=" + folder.string(), "--threads=" + std::to_string(job.threads)};
    for (const std::string& option : o.sim) job.command.push_back("--sim=" + option);
    job.command.push_back("--run");
    job.afterwards = {program, "wedge", "--output=" + folder.string(), "--collect"};
    job.folder = folder;
    std::vector<const scene::Scene*> scenes;
    for (const scene::Scene& scene : plan.scenes) scenes.push_back(&scene);
    askFor(job, o.slurm, scenes);
    const std::string number = farm::submit(job);
    std::printf("job %s: %zu tasks; logs in %s, pages in %s when all have ended\n", number.c_str(), job.tasks.size(),
                (folder / "logs").c_str(), folder.c_str());
    return kDone;
}

/// For any other queue.
int prepare(const WedgeOptions& o, farm::WedgePlan plan)
{
    const fs::path folder = folderOf(o, plan.wedge.name);
    farm::layOut(plan, folder);
    std::printf("%zu runs are laid out; one task each: vdbfrac wedge -o %s --run K, K = 0 to %zu\n",
                plan.wedge.runs.size(), folder.c_str(), plan.wedge.runs.size() - 1);
    return kDone;
}

/// A task: simulates a run, and queues itself again where Slurm told it to stop.
int runTask(const WedgeOptions& o)
{
    const fs::path folder = folderOf(o, "");
    const farm::Wedge wedge = farm::readWedge(folder);
    if (std::size_t(o.run) >= wedge.runs.size())
        throw InputError(
            {"--run", "there is no run " + std::to_string(o.run), "0 to " + std::to_string(wedge.runs.size() - 1), ""});
    const StopRequest stop(std::chrono::steady_clock::now(), INFINITY);
    const int code = farm::runOne(settingsOf(o, folder, stop), wedge.runs[std::size_t(o.run)]);
    if (code != kStopped || stop.reason() != "SIGUSR1" || farm::requeueThisTask()) return code;
    std::fprintf(stderr, "error: %s: Slurm did not queue run %d again; hand the wedge in once more with --slurm\n",
                 folder.c_str(), o.run);
    return kBadFile;
}

int wedge(const WedgeOptions& o)
{
    const bool begun = o.run >= 0 || o.collect;
    if (begun && o.folder.empty())
        throw InputError({"vdbfrac wedge", "no folder", "-o DIR, the folder of the wedge", ""});
    if (!begun && o.input.scene.empty()) throw InputError({"vdbfrac wedge", "no scene", "SCENE", ""});
    if (begun && !fs::exists(fs::path(o.folder) / "wedge.json"))
        throw FileError(o.folder, "holds no wedge; 'vdbfrac wedge SCENE -o DIR --prepare' lays one out");
    if (begun && !(o.input.scene.empty() && o.input.vary.empty() && o.input.set.empty() && !o.input.together))
        throw InputError({"vdbfrac wedge", "--run and --collect go by what the folder was laid out with",
                          "no SCENE, --vary, --together or --set", ""});
    if (o.run >= 0) return runTask(o);
    if (o.collect) {
        std::printf("%s\n", writeReport(o.folder).c_str());
        return kDone;
    }
    const farm::WedgePlan plan = farm::planWedge(o.input);
    return o.list ? list(plan) : o.prepare ? prepare(o, plan) : o.slurm.use ? runOnSlurm(o, plan) : runLocal(o, plan);
}

}  // namespace

Action addWedge(CLI::App& app)
{
    auto o = std::make_shared<WedgeOptions>();
    CLI::App* c = app.add_subcommand("wedge", "Simulate a scene with many settings, here or on a Slurm cluster");
    c->add_option("SCENE", o->input.scene, "Scene file (TOML), with [wedge] or with --vary");
    c->add_option("-o,--output", o->folder, "Folder of the wedge (default: wedge_NAME)")->type_name("DIR");
    auto* how = c->add_option_group("How");
    how->add_flag("--list", o->list, "Only list the runs, with their sizes");
    how->add_flag("--prepare", o->prepare, "Only lay them out in the folder, for --run by another queue than Slurm");
    how->add_flag("--local", o->local, "Simulate them on this machine; goes on where it was stopped");
    addSlurmOptions(*c, *how, o->slurm);
    how->add_option("--run", o->run, "Simulate this one of the folder's runs, here: what a task of the job does")
        ->type_name("K")
        ->check(CLI::Range(0, 1000000));
    how->add_flag("--collect", o->collect,
                  "Make report.html, table.csv and contact_sheet.png from the runs finished so far");
    how->require_option(1);
    c->add_option("--vary", o->input.vary,
                  "Values of a key, in place of [wedge]; may be given several times: every value with every other")
        ->type_name("KEY=V1,V2,...")
        ->allow_extra_args(false);
    c->add_flag("--together", o->input.together, "With --vary: the first value of each key, then the second, ...");
    addSet(*c, o->input.set, "Change a key of the scene in all runs");
    c->add_option("-j,--jobs", o->sideBySide, "With --local: runs at a time (default: 1)")
        ->check(CLI::Range(1, 1024))
        ->type_name("N");
    c->add_option("--threads", o->threads, "Threads of a run (default: the cores shared out; 1 with --slurm)")
        ->check(CLI::Range(0, 1024))
        ->type_name("N");
    c->add_option("--sim", o->sim, "A further option of 'vdbfrac sim', as --sim=--checkpoint-every=5")
        ->type_name("OPTION")
        ->allow_extra_args(false);
    addCommonOptions(*c, o->common);
    return [o] { return wedge(*o); };
}

}  // namespace vdbfrac::cli
